"use strict";
// Makes the figures of the page interactive. Plots over one clock share a cursor, which moves from frame to
// frame and shows the values of its frame. A part of the time can be enlarged, with y axes that fit its
// values. The animation can be paused and moved. The script fetches and stores nothing.
(() => {
  const SVG = (document.querySelector("svg") ?? document.documentElement).namespaceURI;
  const set = (element, attributes) => {
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    return element;
  };
  const make = (name, attributes = {}) => set(document.createElement(name), attributes);
  const drawn = (name, attributes) => set(document.createElementNS(SVG, name), attributes);
  const numbers = text => text.split(" ").map(Number);
  const within = (x, low, high) => Math.min(Math.max(x, low), high);

  // ---- Plots: the SVG groups with an x axis of time or frequency

  const plots = [...document.querySelectorAll("g.plot")].map((group, index) => {
    const [left, top, right, bottom] = numbers(group.dataset.area);
    const [low, high, scale] = group.dataset.y.split(" ");
    const [from, to, along] = group.dataset.x.split(" ");
    const svg = group.ownerSVGElement;
    const figure = svg.closest("figure");
    const whole = [Number(from), Number(to)], y = { low: Number(low), high: Number(high), log: scale === "log" };
    return {
      group, svg, figure, index, left, top, right, bottom, whole, shown: whole,
      timed: along === "time", log: along === "log",
      // (plots over frequency have a cursor for each figure)
      clock: along === "time" ? figure.dataset.clock ?? figure.id : `${figure.id} frequency`,
      y, tall: y,
      label: group.dataset.label,
    };
  });
  const of = clock => plots.filter(plot => plot.clock === clock);
  const place = (plot, time, [from, to] = plot.shown) => {
    const share = plot.log ? Math.log(time / from) / Math.log(to / from) : (time - from) / (to - from);
    return plot.left + (plot.right - plot.left) * share;
  };
  const timeAt = (plot, x, [from, to] = plot.shown) => {
    const share = (x - plot.left) / (plot.right - plot.left);
    return plot.log ? from * (to / from) ** share : from + (to - from) * share;
  };
  const valueAt = ({ top, bottom, y }, at) => {
    const share = (bottom - at) / (bottom - top);
    return y.log ? y.low * (y.high / y.low) ** share : y.low + (y.high - y.low) * share;
  };
  const heightOf = ({ top, bottom, tall }, value) => bottom - (bottom - top) * (value - tall.low) / (tall.high - tall.low);
  const decimals = span => within(3 - Math.floor(Math.log10(span)), 0, 9);

  // ---- Paths: `M x y`, then steps `l dx dy ...`, `h dx`, `v dy`, `z`

  const parse = d => {
    const pieces = [];
    let piece, at = [0, 0];
    for (const [, command, rest] of d.matchAll(/([MlhvzL])([^MlhvzL]*)/g)) {
      const steps = rest.match(/-?[\d.]+/g)?.map(Number) ?? [];
      if (command === "M") {
        at = [steps[0], steps[1]];
        pieces.push(piece = { points: [at], closed: false, dot: false });
      } else if (command === "z") {
        piece.closed = true;
      } else {
        const pair = i => command === "h" ? [steps[i], 0] : command === "v" ? [0, steps[i]] : [steps[i], steps[i + 1]];
        for (let i = 0; i < steps.length; i += command === "l" ? 2 : 1) {
          const [dx, dy] = pair(i);
          if (dx === 0 && dy === 0) piece.dot = true;
          piece.points.push(at = [at[0] + dx, at[1] + dy]);
        }
      }
    }
    return pieces;
  };
  const tenth = x => Math.round(10 * x) / 10;
  const written = (pieces, moved, raised) => pieces.map(({ points, closed, dot }) => {
    const [[x, y], ...rest] = points.map(([x, y]) => [tenth(moved(x)), tenth(raised(y))]);
    return dot ? `M${x} ${y}h0` : `M${x} ${y}` + rest.map(p => `L${p[0]} ${p[1]}`).join("") + (closed ? "z" : "");
  }).join("");
  const parsed = new Map();
  const pieces = path => {
    if (!parsed.has(path)) parsed.set(path, parse(path.getAttribute("d")));
    return parsed.get(path);
  };

  // ---- All values of a series, where more are known than drawn

  const frames = series => {
    if (!series.dataset.grid) return undefined;
    if (series.frames) return series.frames;
    const [start, step, digits] = numbers(series.dataset.grid);
    let before = 0;
    const values = series.dataset.values.split(" ").map(v => v === "-" ? undefined : (before += Number(v)) / 10 ** digits);
    return series.frames = { start, step, values, digits: Math.max(digits, 0) };
  };
  // The value of a series at a time; between two of its frames, by linear interpolation.
  const frameValue = ({ start, step, values }, time) => {
    const at = (time - start) / step, before = Math.floor(at + 1e-6), part = at - before;
    if (part < 1e-3) return values[before];
    const [a, b] = [values[before], values[before + 1]];
    return a === undefined || b === undefined ? undefined : a + part * (b - a);
  };
  // The time of the frame that is nearest, in the first series of a clock that has every frame.
  const frameTime = (clock, time) => {
    for (const series of of(clock).flatMap(plot => [...plot.group.querySelectorAll(".series")])) {
      const all = frames(series);
      if (all) return all.start + all.step * within(Math.round((time - all.start) / all.step), 0, all.values.length - 1);
    }
    return time;
  };
  // The same as a path of a part of the time.
  const path = (plot, { start, step, values }) => {
    const [from, to] = plot.shown;
    const first = Math.max(Math.floor((from - start) / step) - 1, 0);
    const last = Math.min(Math.ceil((to - start) / step) + 1, values.length - 1);
    let d = "", open = false;
    for (let i = first; i <= last; i += 1) {
      if (values[i] === undefined) { open = false; continue; }
      d += `${open ? "L" : "M"}${tenth(place(plot, start + i * step))} ${tenth(heightOf(plot, values[i]))}`;
      open = true;
    }
    return d;
  };

  // ---- Values under the cursor

  // Height of a line, or of the nearest dot, at a place of the whole axis; undefined where there is neither.
  const heightAt = (paths, x) => {
    let best, apart = 6;
    for (const { points, dot } of paths.flatMap(pieces)) {
      if (x < points[0][0] - apart || x > points[points.length - 1][0] + apart) continue;
      if (dot || points.length < 2) {
        const away = Math.abs(points[0][0] - x);
        if (away <= apart) [best, apart] = [points[0][1], away];
        continue;
      }
      let low = 0, high = points.length - 1;
      while (high - low > 1) {
        const middle = (low + high) >> 1;
        if (points[middle][0] <= x) low = middle; else high = middle;
      }
      const [[x0, y0], [x1, y1]] = [points[low], points[high]];
      if (x >= x0 && x <= x1) return x1 > x0 ? y0 + (y1 - y0) * (x - x0) / (x1 - x0) : y0;
    }
    return best;
  };
  const values = (plot, time) => {
    const x = place(plot, time, plot.whole);
    const digits = within(3 - Math.floor(Math.log10(Math.abs(plot.y.high - plot.y.low))), 0, 6);
    const said = [...plot.group.querySelectorAll(".series")].flatMap(series => {
      const all = frames(series);
      const at = all ? undefined : heightAt([...series.querySelectorAll("path")], x);
      const value = all ? frameValue(all, time) : at && valueAt(plot, at);
      if (value === undefined) return [];
      const name = series.dataset.label ? `${series.dataset.label} ` : "";
      return [name + (plot.y.log ? value.toPrecision(3) : value.toFixed(all ? all.digits : digits)).replace("-", "\u2212")];
    });
    return said.length ? `${plot.label}: ${said.join(", ")}` : "";
  };

  // ---- The cursor

  const state = { clock: undefined, time: undefined, figure: undefined };
  const cursorOf = plot => {
    plot.cursor ??= plot.group.appendChild(drawn("line", { class: "cursor", y1: plot.top, y2: plot.bottom }));
    return plot.cursor;
  };
  const point = (clock, time, figure, animations = true) => {
    time = frameTime(clock, time);
    if (state.clock !== clock) of(state.clock).forEach(plot => plot.cursor?.setAttribute("visibility", "hidden"));
    Object.assign(state, { clock, time, figure: figure ?? state.figure });
    for (const plot of of(clock)) {
      const [from, to] = plot.shown, inside = time >= from && time <= to;
      if (!inside && !plot.cursor) continue;
      const line = cursorOf(plot), x = place(plot, within(time, from, to));
      line.setAttribute("visibility", inside ? "visible" : "hidden");
      line.setAttribute("x1", x);
      line.setAttribute("x2", x);
    }
    say();
    if (animations) movies.filter(movie => movie.clock === clock).forEach(movie => movie.show(time));
  };
  const span = clock => {
    const all = of(clock);
    return [Math.min(...all.map(p => p.shown[0])), Math.max(...all.map(p => p.shown[1]))];
  };

  // ---- A part of the time, enlarged

  const kept = new Map();
  const original = (element, name) => {
    const key = kept.get(element) ?? kept.set(element, {}).get(element);
    return key[name] ??= element.getAttribute(name);
  };
  const clip = plot => {
    const id = `within-${plot.index}`;
    if (!document.getElementById(id)) {
      const path = drawn("clipPath", { id });
      path.append(drawn("rect", {
        x: plot.left, y: plot.top, width: plot.right - plot.left, height: plot.bottom - plot.top,
      }));
      plot.svg.append(path);
    }
    return `url(#${id})`;
  };
  // A shape of at most the size of a symbol keeps its form; a larger one is stretched.
  const SYMBOL = 16;
  const stretch = (element, moved, raised, { top, bottom }) => {
    switch (element.tagName) {
      case "path":
        pieces(element);
        original(element, "d");
        element.setAttribute("d", written(pieces(element), moved, raised));
        break;
      case "polygon": {
        const corners = original(element, "points").trim().split(/\s+/).map(p => p.split(",").map(Number));
        const keep = (at, of) => {
          const low = Math.min(...at), high = Math.max(...at), middle = (low + high) / 2;
          return high - low <= SYMBOL ? x => of(middle) + x - middle : of;
        };
        const x = keep(corners.map(c => c[0]), moved), y = keep(corners.map(c => c[1]), raised);
        element.setAttribute("points", corners.map(c => `${x(c[0])},${y(c[1])}`).join(" "));
        break;
      }
      case "circle":
        element.setAttribute("cx", moved(Number(original(element, "cx"))));
        element.setAttribute("cy", raised(Number(original(element, "cy"))));
        break;
      case "text": {
        const y = Number(original(element, "y")), to = raised(y);
        element.setAttribute("x", moved(Number(original(element, "x"))));
        element.setAttribute("y", to > top && to < bottom ? to : y);
        break;
      }
    }
  };
  const step = (from, to, most) => {
    const raw = (to - from) / most, power = 10 ** Math.floor(Math.log10(raw));
    return [1, 2, 5, 10].map(m => m * power).find(s => s >= raw);
  };
  const firstTicks = new Map();
  // Draws the ticks of an axis in an enlarged part, and the first ticks otherwise. `at` gives the position of
  // a value, `mark` the path of a tick at this position, and `key` is the coordinate along the axis.
  const ticks = (group, enlarged, [from, to], most, key, at, mark) => {
    if (!firstTicks.has(group)) firstTicks.set(group, [...group.childNodes]);
    const first = firstTicks.get(group);
    if (!enlarged) return group.replaceChildren(...first);
    const by = step(from, to, most), marks = [];
    const label = first.find(node => node.tagName === "text");
    // (the baseline of a label lies below the tick)
    const heights = first.flatMap(node => [node, ...(node.querySelectorAll?.("path") ?? [])])
      .filter(node => node.tagName === "path").map(node => pieces(node)[0].points[0][1]);
    const off = key === "x" || !label ? 0 : heights.map(y => Number(label.getAttribute("y")) - y)
      .reduce((a, b) => Math.abs(b) < Math.abs(a) ? b : a, Infinity);
    const frame = drawn("g", { stroke: "#333333", "stroke-width": 3, fill: "none" });
    for (let t = Math.ceil(from / by) * by; t <= to + by * 1e-9; t += by) {
      const place = at(t);
      frame.append(drawn("path", { d: mark(place), stroke: "#333333" }));
      if (!label) continue;
      const text = label.cloneNode(false);
      text.setAttribute(key, place + off);
      text.textContent = `\n${t.toFixed(within(-Math.floor(Math.log10(by)), 0, 9)).replace("-", "\u2212")}\n`;
      marks.push(text);
    }
    group.replaceChildren(frame, ...marks);
  };
  // The y axis that fits the values in an enlarged part, with a margin. Logarithmic axes, heat maps and parts
  // without values keep the whole axis.
  const shownHeights = plot => {
    const [from, to] = plot.shown, found = [];
    if (plot.shown === plot.whole || plot.y.log || plot.group.dataset.heat) return plot.y;
    for (const series of plot.group.querySelectorAll(".series")) {
      const all = frames(series);
      if (all) {
        const first = Math.max(Math.ceil((from - all.start) / all.step), 0);
        found.push(...all.values.slice(first, Math.floor((to - all.start) / all.step) + 1).filter(v => v !== undefined));
        continue;
      }
      const points = [...series.querySelectorAll("path")].flatMap(pieces).flatMap(piece => piece.points);
      const left = place(plot, from, plot.whole), right = place(plot, to, plot.whole);
      found.push(...points.filter(([x]) => x >= left && x <= right).map(([, at]) => valueAt(plot, at)));
    }
    const low = found.reduce((a, b) => Math.min(a, b), Infinity), high = found.reduce((a, b) => Math.max(a, b), -Infinity);
    const margin = 0.06 * (high - low);
    return high > low ? { ...plot.y, low: low - margin, high: high + margin } : plot.y;
  };
  const redraw = plot => {
    const [from, to] = plot.shown, moved = x => place(plot, timeAt(plot, x, plot.whole));
    plot.tall = shownHeights(plot);
    const isTaller = plot.tall !== plot.y, raised = y => isTaller ? heightOf(plot, valueAt(plot, y)) : y;
    for (const group of plot.group.querySelectorAll(".within")) {
      group.setAttribute("clip-path", clip(plot));
      group.querySelectorAll("path, polygon, circle, text").forEach(element => stretch(element, moved, raised, plot));
      for (const series of plot.shown === plot.whole ? [] : group.querySelectorAll(".series")) {
        const all = frames(series), [line, ...rest] = series.querySelectorAll("path");
        if (!all || !line) continue;
        line.setAttribute("d", path(plot, all));
        rest.forEach(element => element.setAttribute("d", ""));
      }
    }
    const over = plot.group.querySelector(".over");
    if (over) over.style.display = plot.shown === plot.whole ? "" : "none";
    // (the picture of a heat map is clipped by the element that holds it)
    if (plot.picture) {
      const left = place(plot, plot.whole[0]);
      set(plot.picture, { x: left - plot.left, width: place(plot, plot.whole[1]) - left });
    }
    ticks(plot.group.querySelector(".ticks"), plot.shown !== plot.whole, plot.shown,
      plot.right - plot.left > 1200 ? 7 : 4, "x", t => place(plot, t), x => `M${x} ${plot.bottom}v12`);
    ticks(plot.group.querySelector(".y-ticks"), isTaller, [plot.tall.low, plot.tall.high],
      plot.bottom - plot.top > 300 ? 5 : 3, "y", v => heightOf(plot, v), y => `M${plot.left - 12} ${y}h12`);
  };
  const zoom = (clock, part) => {
    for (const plot of of(clock).filter(plot => plot.timed)) {
      const [from, to] = part ? [Math.max(part[0], plot.whole[0]), Math.min(part[1], plot.whole[1])] : plot.whole;
      if (part && !(to > from)) continue;
      const shown = from <= plot.whole[0] && to >= plot.whole[1] ? plot.whole : [from, to];
      if (shown[0] === plot.shown[0] && shown[1] === plot.shown[1]) continue;
      plot.shown = shown;
      redraw(plot);
    }
    bar.update();
    if (state.time !== undefined) point(clock, within(state.time, ...span(clock)));
  };
  const LEAST_S = 1e-4;
  const closer = factor => {
    const clock = state.clock ?? plots[0].clock, [from, to] = span(clock);
    const middle = state.time ?? (from + to) / 2, half = Math.max((to - from) * factor, LEAST_S) / 2;
    const whole = [Math.min(...of(clock).map(p => p.whole[0])), Math.max(...of(clock).map(p => p.whole[1]))];
    const part = [Math.max(middle - half, whole[0]), Math.min(middle + half, whole[1])];
    zoom(clock, part[0] <= whole[0] && part[1] >= whole[1] ? undefined : part);
  };

  // ---- The pointer

  const under = event => {
    const svg = event.currentTarget, matrix = svg.getScreenCTM();
    if (!matrix) return {};
    const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(matrix.inverse());
    const plot = plots.find(p => p.svg === svg && at.x >= p.left && at.x <= p.right && at.y >= p.top && at.y <= p.bottom);
    return { at, plot };
  };
  let drag;
  const listen = svg => {
    svg.classList.add("live");
    svg.addEventListener("pointerdown", event => {
      const { at, plot } = under(event);
      if (!plot?.timed || event.button !== 0) return;
      drag = { plot, from: at.x, box: drawn("rect", { class: "chosen", y: plot.top, height: plot.bottom - plot.top, width: 0 }) };
      plot.group.append(drag.box);
      svg.setPointerCapture(event.pointerId);
      event.preventDefault();
    });
    svg.addEventListener("pointermove", event => {
      const { at, plot } = under(event);
      if (drag) {
        const to = within(at.x, drag.plot.left, drag.plot.right);
        drag.box.setAttribute("x", Math.min(drag.from, to));
        drag.box.setAttribute("width", Math.abs(to - drag.from));
        drag.to = to;
      }
      if (plot) point(plot.clock, timeAt(plot, at.x), plot.figure);
    });
    const end = event => {
      if (!drag) return;
      const { plot, from, to, box } = drag;
      box.remove();
      drag = undefined;
      // (a touch that turns out to scroll the page is cancelled)
      if (event.type === "pointerup" && to !== undefined && Math.abs(to - from) > 20) {
        zoom(plot.clock, [timeAt(plot, Math.min(from, to)), timeAt(plot, Math.max(from, to))]);
      }
    };
    svg.addEventListener("pointerup", end);
    svg.addEventListener("pointercancel", end);
    svg.addEventListener("dblclick", event => {
      const { plot } = under(event);
      if (plot) zoom(plot.clock);
    });
  };

  // ---- The animation

  const movies = [...document.querySelectorAll("svg .moves")].map(moves => {
    const svg = moves.ownerSVGElement, figure = svg.closest("figure");
    const parts = moves.dataset.pace.split(";").map(numbers);
    const length = Number(moves.dataset.duration);
    const at = time => parts.reduce((sum, [from, to, slower]) => sum + (within(time, from, to) - from) * slower, 0);
    const timeOf = shown => {
      for (const [from, to, slower] of parts) {
        if (shown <= (to - from) * slower) return from + shown / slower;
        shown -= (to - from) * slower;
      }
      return parts[parts.length - 1][1];
    };
    const [first, last] = [parts[0][0], parts[parts.length - 1][1]];
    const box = make("div", { class: "player" });
    const button = make("button", { type: "button" });
    const slider = make("input", {
      type: "range", min: 0, max: 1000, value: 0, "aria-label": "Instant of the animation",
    });
    const clock = make("output");
    box.append(button, slider, clock);
    svg.closest(".drawing").after(box);
    const movie = { clock: figure.dataset.clock ?? figure.id, playing: false };
    const tell = () => {
      const time = timeOf(svg.getCurrentTime() % length);
      slider.value = Math.round(1000 * (time - first) / (last - first));
      slider.setAttribute("aria-valuetext", clock.textContent = `${time.toFixed(4)} s`);
      return time;
    };
    const frame = () => {
      if (!movie.playing) return;
      point(movie.clock, tell(), figure, false);
      requestAnimationFrame(frame);
    };
    const play = on => {
      movie.playing = on;
      button.textContent = on ? "Pause" : "Play";
      if (on) svg.unpauseAnimations(); else svg.pauseAnimations();
      if (on) requestAnimationFrame(frame);
    };
    movie.show = time => {
      if (movie.playing || time < first || time > last) return;
      svg.setCurrentTime(at(time));
      tell();
    };
    button.addEventListener("click", () => play(!movie.playing));
    slider.addEventListener("input", () => {
      play(false);
      point(movie.clock, first + (last - first) * slider.value / 1000, figure);
    });
    // (who asked for less motion sees it move when asking for it)
    moves.style.display = "inline";
    play(false);
    svg.setCurrentTime(0);
    tell();
    return movie;
  });

  // ---- The bar at the foot of the window

  const bar = (() => {
    const box = make("div", { class: "reader", role: "group", "aria-label": "Cursor of the figures" });
    const slider = make("input", { type: "range", min: 0, max: 1000, value: 0, "aria-label": "Time of the cursor" });
    const said = make("output", { role: "status", "aria-live": "polite" });
    const button = (name, title, act) => {
      const made = make("button", { type: "button", title, "aria-label": title });
      made.textContent = name;
      made.addEventListener("click", act);
      return made;
    };
    const whole = button("all", "Show the whole time", () => zoom(state.clock ?? plots[0].clock));
    box.append(
      slider,
      button("+", "Enlarge about the cursor", () => closer(0.5)),
      button("\u2212", "Show more", () => closer(2)),
      whole,
      said,
    );
    slider.addEventListener("input", () => {
      const clock = state.clock ?? plots[0].clock, [from, to] = span(clock);
      point(clock, from + (to - from) * slider.value / 1000, state.figure ?? plots[0].figure);
    });
    said.textContent = "Point at a figure over time to read it. Drag to enlarge a part.";
    return {
      box, slider, said,
      update() { whole.disabled = plots.every(plot => plot.shown === plot.whole); },
    };
  })();
  const say = () => {
    const { clock, time, figure } = state, [from, to] = span(clock);
    bar.slider.value = Math.round(1000 * (time - from) / (to - from));
    const width = plot => plot.whole[1] - plot.whole[0];
    const here = of(clock).filter(plot => plot.figure === figure && time >= plot.shown[0] && time <= plot.shown[1]);
    // (of a quantity that is shown twice, the whole is read, which holds every frame)
    const shown = here.filter(plot => !here.some(other => other.label === plot.label && width(other) > width(plot)));
    const read = shown.map(plot => values(plot, time)).filter(Boolean).join("; ");
    const unit = of(clock)[0].timed ? "s" : "Hz";
    const instant = `${time.toFixed(decimals(to - from))} ${unit}`.replace("-", "\u2212");
    bar.slider.setAttribute("aria-valuetext", instant);
    bar.said.textContent = read ? `${instant}: ${read}` : instant;
  };

  if (plots.length) {
    for (const svg of new Set(plots.map(plot => plot.svg))) {
      for (const plot of plots.filter(plot => plot.svg === svg && plot.group.dataset.heat)) {
        const holds = box => Math.abs(box.getAttribute("x") - plot.left) < 1 && Math.abs(box.getAttribute("y") - plot.top) < 1;
        plot.picture = [...svg.querySelectorAll("svg")].find(holds)?.querySelector("image");
      }
      listen(svg);
    }
    document.body.append(bar.box);
    bar.update();
    document.addEventListener("keydown", event => {
      if (event.key === "Escape" && state.clock !== undefined) zoom(state.clock);
    });
  }
  // What is folded is printed too.
  addEventListener("beforeprint", () => document.querySelectorAll("main > details").forEach(d => { d.open = true; }));
})();
