//! Commands with a slider: a synthetic recording and the fit to it, a study, and the mode.

use crate::small_fit::Project;
use serde_json::Value;

fn project() -> Project {
    let project = Project::of("blade");
    project.write("data/scenes/slider-frame.toml", include_str!("../../data/scenes/slider-frame.toml"));
    project.write("data/twins/slider-frame.toml", include_str!("../../data/twins/slider-frame.toml"));
    project
}

fn run(project: &Project, arguments: &[&str]) -> String {
    let (code, said, err) = project.run(arguments);
    assert_eq!(code, 0, "{arguments:?}\n{said}{err}");
    said
}

#[test]
fn a_first_fit_of_a_slider_finds_its_friction() {
    let project = project();
    run(&project, &["twin", "data/twins/slider-frame.toml", "--out", "rec"]);
    let trace = project.read("rec/trace.csv");
    let heights = trace.lines().skip(1).all(|row| row.split(',').nth(2) == Some("") && row.ends_with(','));
    assert!(heights && trace.lines().count() == 2502);
    // the same recording in a table without the columns of heights
    let along: String = trace
        .lines()
        .map(|row| row.split(',').collect::<Vec<_>>())
        .map(|cells| format!("{},{},{}\n", cells[0], cells[1], cells[3]))
        .collect();
    project.write("along.csv", &along);
    let columns = "--columns time=time_s,tip-x=tip_x_m,head-x=head_x_m";
    let import = format!("import along.csv --out along --frame-rate-hz 250 --scale m --time real {columns}");
    run(&project, &import.split(' ').collect::<Vec<_>>());
    let init =
        ["init", "along", "--slider", "--mass-kg", "3.0799", "--normal-force-n", "2.4525", "--out", "fit"];
    run(&project, &init);
    let said = run(&project, &["fit", "fit/job.toml"]);
    let result: Value = serde_json::from_str(&project.read("fit/result.json")).unwrap();
    assert_eq!(result["misfit"]["explained"], true, "{said}{}", result["misfit"]["reasons"]);
    // mass and normal force are known to 1 %, the scale of the sensors to 0.5 %: the stiffness is as
    // uncertain as the mass, friction as stiffness and scale divided by the normal force
    let z = 2.0 * 1.96;
    for (name, truth, least, most) in [
        ("friction.c", 0.28, z * 0.015, z * 0.018),
        ("slider.stiffness_n_per_m", 1191.0, z * 0.01, z * 0.012),
        ("slider.damping_n_s_per_m", 0.669, z * 0.01, 0.1),
    ] {
        let found = |key: &str| result["parameters"][name][key].as_f64().unwrap();
        let (low, high) = (found("lower_95"), found("upper_95"));
        let width = (high - low) / truth;
        assert!(low < truth && truth < high, "{name}: {low} to {high}");
        assert!(0.99 * least < width && width < most, "{name}: {width}");
    }
    let start = &result["segments"][0];
    assert!(start["deflection_m"].is_f64() && start.get("lip_angle_rad").is_none(), "{start}");
    run(&project, &["report", "fit", "--out", "page"]);
    assert!(project.path("page/evidence.svg").exists());
    assert!(!project.path("page/poses.svg").exists(), "a slider has no links to draw");
    assert!(!project.path("page/cycle.svg").exists(), "the spectrum between two reversals is noise");
}

#[test]
fn a_study_varies_the_numbers_of_a_slider() {
    let project = project();
    let study = "format = 1\ntitle = \"Load and stiffness\"\nscene = \"data/scenes/slider-frame.toml\"\n\
                 [camera]\nframe_rate_hz = 250.0\nexposure_s = 0.0\n\
                 [[axis]]\nname = \"slider.normal_force_n\"\nfrom = 1.0\nto = 6.0\npoints = 3\n\
                 [[axis]]\nname = \"slider.stiffness_n_per_m\"\nfrom = 600.0\nto = 1200.0\npoints = 2\n\
                 [[map]]\nname = \"stick fraction\"\nkind = \"stick-fraction\"\n";
    project.write("study.toml", study);
    run(&project, &["sweep", "study.toml", "--out", "study"]);
    let table = project.read("study/sweep.csv");
    assert_eq!(table.lines().filter(|row| row.contains("completed")).count(), 6, "{table}");
}

#[test]
fn the_mode_of_a_slider_is_that_of_the_mass_on_its_spring() {
    let said = run(&project(), &["modes", "data/scenes/slider-frame.toml"]);
    assert!(said.contains("3.130        3.130    0.0055"), "{said}");
}

#[test]
fn the_stability_of_a_slider_has_one_mode_and_names_its_own_numbers() {
    let project = project();
    let scene = project.read("data/scenes/slider-frame.toml").replace("a = 0.0", "a = 0.2");
    project.write("falling.toml", &scene.replace("b_s_per_m = 0.0", "b_s_per_m = 10.0"));
    let said = run(&project, &["stability", "falling.toml", "--out", "st", "--speed-m-per-s", "0..1"]);
    // ln(2.4525 * 0.2 * 10 / 0.669) / 10
    assert!(said.contains("unstable between 0.000 and 0.1992 m/s"), "{said}");
    assert!(said.contains("damping between head and slider"), "{said}");
    let table = project.read("st/stability.csv");
    assert!(table.lines().skip(1).all(|row| row.contains(",2.4525,none,1,")), "{table}");
    // without a spring nothing holds the slider
    project.write("loose.toml", &scene.replace("stiffness_n_per_m = 1191.0", "stiffness_n_per_m = 0.0"));
    let (code, _, err) = project.run(&["stability", "loose.toml", "--out", "none"]);
    assert_eq!(code, 2, "{err}");
    assert!(err.contains("loose.toml") && err.contains("there is no equilibrium"), "{err}");
    assert!(!project.path("none").exists());
}

#[test]
fn two_loads_share_the_stiffness_and_each_has_its_own_friction() {
    let project = project();
    let scene = project.read("data/scenes/slider-frame.toml");
    let twin = project.read("data/twins/slider-frame.toml");
    let loads = [("2.4525", "0.28"), ("5.3955", "0.30")];
    let mut recordings = String::new();
    for (at, (load, friction)) in loads.into_iter().enumerate() {
        let scene = scene.replace("2.4525", load).replace("c = 0.28", &format!("c = {friction}"));
        project.write(&format!("data/scenes/load-{at}.toml"), &scene);
        project.write(
            &format!("data/twins/load-{at}.toml"),
            &twin.replace("slider-frame", &format!("load-{at}")),
        );
        run(&project, &["twin", &format!("data/twins/load-{at}.toml"), "--out", &format!("rec-{at}")]);
        recordings += &format!(
            "[[recording]]\npath = \"../rec-{at}\"\nset = {{ \"slider.normal_force_n\" = {load} }}\n\
             [[trace]]\nrecording = {}\nchannels = [\"tip-x\"]\n[trace.camera]\nscale_sd = 0.0\n",
            at + 1
        );
    }
    let job = format!(
        "format = 1\ntitle = \"Two loads\"\nscene = \"../data/scenes/slider-frame.toml\"\nseed = 1\n\
         nuisance = [{{ name = \"slider.mass_kg\", sd = \"1 %\" }}]\n{recordings}\
         [[parameter]]\nname = \"friction.c\"\nlower = 0.03\nupper = 1.5\nscale = \"log\"\nscope = \"recording\"\n\
         [[parameter]]\nname = \"slider.stiffness_n_per_m\"\nlower = 100\nupper = 6000\nscale = \"log\"\n\
         [[parameter]]\nname = \"slider.damping_n_s_per_m\"\nlower = 0.0\nupper = 20.0\nscale = \"linear\"\n"
    );
    project.write("fit/job.toml", &job);
    let said = run(&project, &["fit", "fit"]);
    let result: Value = serde_json::from_str(&project.read("fit/result.json")).unwrap();
    assert_eq!(result["misfit"]["explained"], true, "{said}");
    let found = |name: &str| {
        let one = &result["parameters"][name];
        assert_eq!(one["verdict"], "identified", "{name}: {one}");
        ["lower_95", "estimate", "upper_95"].map(|key| one[key].as_f64().unwrap())
    };
    let expected = [
        ("friction.c@1", 0.28),
        ("friction.c@2", 0.30),
        ("slider.stiffness_n_per_m", 1191.0),
        ("slider.damping_n_s_per_m", 0.669),
    ];
    for (name, truth) in expected {
        let [low, estimate, high] = found(name);
        assert!(
            low < truth && truth < high && (estimate / truth - 1.0).abs() < 0.05,
            "{name}: {low} to {high}"
        );
    }
    assert_eq!(result["parameters"].as_object().unwrap().len(), 4);
    // what the fit leaves describes each load
    for (at, (load, _)) in loads.into_iter().enumerate() {
        let scene: toml::Table = project.read(&format!("fit/fitted-scene-{}.toml", at + 1)).parse().unwrap();
        let number = |table: &str, key: &str| scene[table][key].as_float().unwrap();
        assert_eq!(number("slider", "normal_force_n"), load.parse::<f64>().unwrap());
        let name = format!("friction.c@{}", at + 1);
        assert_eq!(number("friction", "c"), found(&name)[1]);
        let text = project.read(&format!("fit/fitted-scene-{}.toml", at + 1));
        let [low, _, high] = found(&name);
        let is_stated = |note: &str| {
            let stated: Vec<f64> = note.split(' ').filter_map(|word| word.parse().ok()).collect();
            matches!(stated[..], [.., a, b] if (a - low).abs() < 1e-3 && (b - high).abs() < 1e-3)
        };
        assert!(text.lines().filter(|line| line.starts_with("# fitted")).any(is_stated), "{text}");
    }
    run(&project, &["report", "fit", "--out", "page"]);
    let report: Value = serde_json::from_str(&project.read("page/report.json")).unwrap();
    assert_eq!(report["parameters"][0]["symbol"], "C@1", "{}", report["parameters"]);
    let features =
        job.split("[[trace]]").next().unwrap().to_owned() + job.split("scale_sd = 0.0\n").last().unwrap();
    project.write("fit/features.toml", &features);
    let (code, _, err) = project.run(&["fit", "fit/features.toml"]);
    assert!(code == 2 && err.contains("`friction.c`, `scope`"), "{err}");
}
