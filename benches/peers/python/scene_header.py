"""Writes the numbers of a scene file as a C header, so that no program of the comparison has its own copy of them.

usage: scene_header.py SCENE.toml > scene.h
"""
import sys
import tomllib

NAMES = {"a": "FRICTION_A", "b_s_per_m": "FRICTION_B_S_PER_M", "c": "FRICTION_C"}


def main():
    with open(sys.argv[1], "rb") as file:
        scene = tomllib.load(file, parse_float=str)
    if "shoulder" in scene or float(scene["start"]["time_s"]) != 0 or scene["start"]["kind"] != "upright":
        sys.exit(f"{sys.argv[1]}: the peers are written for a blade without a shoulder that starts upright at t = 0")
    print("/* Written by scene_header.py from the scene file. */")
    for table, key in [(t, k) for t in ("blade", "friction", "drive") for k in scene[t]] + [("run", "stop_s")]:
        print(f"#define {NAMES.get(key, key.upper())} NUMBER({scene[table][key]})")


main()
