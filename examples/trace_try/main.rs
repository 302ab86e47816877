#![allow(missing_docs, dead_code)]
mod truth;
use std::collections::HashMap;
use std::sync::Arc;
use std::time::Instant;
use wiperlab::fit::job::Job;
use wiperlab::fit::trace::*;
use wiperlab::recording::files::{read_recording, RecordingFile};
use wiperlab::recording::quality::quality;
use wiperlab::simulate::drive::{Drive, head_motion};
use wiperlab::simulate::scene::Scene;

const SCENE: &str = include_str!("../../data/scenes/actual-blade.toml");
const JOB: &str = include_str!("../recovery/job.toml");
const FIVE: [(&str, f64, f64); 5] = [("friction.a", 0.03, 0.4), ("friction.b_s_per_m", 1.0, 20.0), ("friction.c", 0.1, 0.6), ("blade.neck_stiffness_n_m_per_rad", 0.0009, 0.0038), ("shoulder.stiffness_n_m_per_rad", 0.008, 0.12)];

fn main() {
    let o: HashMap<String, String> = std::env::args().skip(1).filter_map(|a| a.split_once('=').map(|(a, b)| (a.to_owned(), b.to_owned()))).collect();
    let get = |k: &str, d: &str| o.get(k).cloned().unwrap_or(d.to_owned());
    let plain = Scene::parse("actual-blade.toml", SCENE).unwrap();
    let job = Job::parse("job.toml", JOB).unwrap();
    let lengths: Vec<f64> = get("L", "4,8,16").split(',').map(|x| 1e-3 * x.parse::<f64>().unwrap()).collect();
    let recs: Vec<String> = get("rec", "").split(',').filter(|x| !x.is_empty()).map(str::to_owned).collect();
    let twins: Vec<u64> = get("twins", "0").split(',').flat_map(|x| match x.split_once('-') { Some((a, b)) => (a.parse().unwrap()..=b.parse().unwrap()).collect::<Vec<u64>>(), None => vec![x.parse().unwrap()] }).collect();
    let cam = get("cam", "");
    let verbose = o.contains_key("v");
    let mut inside = [0usize; 5];
    let mut count = 0;
    let mut errors: Vec<Vec<f64>> = vec![vec![]; 5];
    let list: Vec<String> = if recs.is_empty() { twins.iter().map(|t| t.to_string()).collect() } else { recs };
    for name in list {
        let (recording, exposure, truth) = if let Ok(number) = name.parse::<u64>() {
            let t = truth::twin(&plain, &job, number, 1);
            (t.recording, truth::EXPOSURE_S, t.truth)
        } else {
            let text = std::fs::read_to_string(format!("{name}/trace.csv")).unwrap();
            let d = RecordingFile::parse("recording.toml", &std::fs::read_to_string(format!("{name}/recording.toml")).unwrap()).unwrap();
            let r = read_recording("rec", "trace.csv", &text, Some(&d)).unwrap();
            let j: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(format!("{name}/truth.json")).unwrap()).unwrap();
            (r, 5e-5, FIVE.iter().map(|f| j["truth"][f.0].as_f64().unwrap()).collect())
        };
        let recording = if o.contains_key("hard") { hard(&recording) } else { recording };
        let mut scene = plain.clone();
        if get("drive", if name.parse::<u64>().is_ok() { "scene" } else { "head" }) == "head" { scene.drive = Drive::Recorded(Arc::new(head_motion(&recording).unwrap())); }
        let q = quality(&recording, None);
        let sigma = get("sigma", "").parse().unwrap_or(q.head_x.noise_m.unwrap_or(2e-6));
        let n = recording.grid().frames;
        let edge = if o.contains_key("edge") { get("edge", "12").parse().unwrap() } else { 12 };
        let film = Film::new(&recording, &scene.drive, FilmSettings { tip_x: true, head_drop: !o.contains_key("tiponly"), exposure_s: exposure, noise_m: [sigma; 2], frames: [edge, n - edge] });
        let mut unknowns: Vec<Unknown> = FIVE.iter().map(|(name, low, high)| { let [a, b] = [low.ln(), high.ln()]; Unknown { kind: Kind::Parameter { name: (*name).to_owned(), unit: None }, range: [a, b], prior: None, start: 0.5 * (a + b) } }).collect();
        for c in cam.split(',').filter(|c| !c.is_empty()) {
            let (what, sd) = match c { "dx" => (CameraUnknown::OffsetX, 5.0), "du" => (CameraUnknown::OffsetDrop, 5.0), "scale" => (CameraUnknown::Scale, 0.5), "tilt" => (CameraUnknown::Tilt, 1.0), _ => (CameraUnknown::Clock, 1.0) };
            unknowns.push(Unknown { kind: Kind::Camera { film: 0, what }, range: [-100.0, 100.0], prior: Some([0.0, sd]), start: 0.0 });
        }
        // first guesses of offsets
        let mut lean: Vec<f64> = (0..n).filter_map(|i| film.tip_x_m[i].map(|x| x - film.head_m[i])).collect();
        lean.sort_by(f64::total_cmp);
        let dx = 0.5 * (lean[lean.len() / 10] + lean[lean.len() * 9 / 10]);
        let mut drops: Vec<f64> = film.drop_m.iter().flatten().copied().collect();
        drops.sort_by(f64::total_cmp);
        for u in &mut unknowns { match u.kind { Kind::Camera { what: CameraUnknown::OffsetX, .. } => u.start = dx / 1e-4, Kind::Camera { what: CameraUnknown::OffsetDrop, .. } if !drops.is_empty() => u.start = (drops[drops.len() / 200] + 2.0 * sigma) / 1e-4, _ => {} } }
        let start: Vec<f64> = unknowns.iter().map(|u| u.start).collect();
        let mut start = start;
        if o.contains_key("truth") { for i in 0..5 { start[i] = truth[i].ln(); } }
        let model = TraceModel { shoots: vec![Shoot { scene, film }], unknowns: Unknowns(unknowns) };
        let settings = Settings { segment_s: lengths.clone() };
        let clock = Instant::now();
        let mut at = begin(&model, &settings, &start).unwrap();
        let show = |it: &Iterate, tag: &str| {
            let (c, d): (f64, usize) = it.segments.iter().fold((0.0, 0), |(c, d), s| (c + s.chi2, d + s.data));
            println!("  {tag} stage {} step {} {} segs {} bad {} cost {:.1} chi2/dof {:.3} point {:?}", it.stage, it.number, if it.plain { "plain" } else { "robust" }, it.segments.len(), it.segments.iter().filter(|s| s.is_bad()).count(), it.cost, c / (d as f64 - 4.0 * it.segments.len() as f64), it.point.iter().enumerate().map(|(i, z)| if i < 5 { format!("{:+.2}%", 100.0 * (z - truth[i].ln())) } else { format!("{z:.4}") }).collect::<Vec<_>>());
        };
        if verbose { show(&at, "begin"); }
        while let Some(next) = advance(&model, &settings, &at) {
            if verbose { show(&next, ""); } else if next.stage != at.stage { show(&at, ""); }
            at = next;
        }
        let wall = clock.elapsed().as_secs_f64();
        show(&at, &format!("{name} END noise {:.2} um {wall:.2} s", 1e6 * sigma));
        if let Some(c) = covariance(&model, &at) {
            let sd: Vec<f64> = (0..start.len()).map(|i| c.curvature[(i, i)].sqrt()).collect();
            let sw: Vec<f64> = (0..start.len()).map(|i| c.sandwich[(i, i)].sqrt()).collect();
            let f = |v: &[f64]| v.iter().map(|s| format!("{:.3}", 100.0 * s)).collect::<Vec<_>>().join(" ");
            println!("     sd% {} | sw% {}", f(&sd), f(&sw));
            println!("     z {:?}", (0..5).map(|i| format!("{:+.1}", (at.point[i] - truth[i].ln()) / sd[i].max(sw[i]))).collect::<Vec<_>>());
            count += 1;
            for i in 0..5 { let e = at.point[i] - truth[i].ln(); errors[i].push(100.0 * e.abs()); if e.abs() < 1.96 * sd[i].max(sw[i]) { inside[i] += 1; } }
        }
        if o.contains_key("worst") {
            let mut s = at.segments.clone(); s.sort_by(|a, b| b.excess().total_cmp(&a.excess()));
            for s in &s[..6.min(s.len())] { println!("     worst {}..{} excess {:.1} chi2/n {:.2} shown {:?} start {:?}", s.first, s.last, s.excess(), s.chi2 / s.data as f64, s.shown, s.start); }
        }
    }
    println!("inside {inside:?} of {count}");
    for e in &mut errors { e.sort_by(f64::total_cmp); if !e.is_empty() { print!(" median {:.3} max {:.2};", e[e.len() / 2], e[e.len() - 1]); } }
    println!();
}

fn hard(r: &wiperlab::recording::Recording) -> wiperlab::recording::Recording {
    use rand::{Rng, SeedableRng};
    use rand_distr::StandardNormal;
    let mut g = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(77);
    let t = r.traces();
    let n = r.grid().frames;
    let rho: f64 = 0.6f64.powf(5000.0 / r.grid().frame_rate_hz);
    let inno = (1.0 - rho * rho).sqrt();
    let mut ar = [0.0f64; 6];
    let mut out = t.clone();
    let (tilt, scale, px) = (0.3f64.to_radians(), 1.005, 20e-6);
    let lock = |x: f64| x + 0.05 * px * (2.0 * std::f64::consts::PI * x / px).sin();
    for i in 0..n {
        for a in &mut ar { let z: f64 = g.sample(StandardNormal); *a = rho * *a + inno * z; }
        let s = 2e-6 / 2f64.sqrt();
        let lost = [g.random::<f64>() < 0.03, g.random::<f64>() < 0.03];
        let mut put = |x: Option<f64>, y: Option<f64>, off: [f64; 2], own: [f64; 2], lost: bool| -> (Option<f64>, Option<f64>) {
            let (Some(x), Some(y)) = (x, y) else { return (None, None) };
            if lost { return (None, None) }
            let (x, y) = (x + off[0], y + off[1]);
            let (x, y) = (x * tilt.cos() - y * tilt.sin(), x * tilt.sin() + y * tilt.cos());
            (Some(lock(scale * x + s * (ar[0] + own[0]))), Some(lock(scale * y + s * (ar[1] + own[1]))))
        };
        let (a, b) = put(t.tip_x_m[i], t.tip_y_m[i], [0.0; 2], [ar[2], ar[3]], lost[0]);
        out.tip_x_m[i] = a; out.tip_y_m[i] = b;
        let (a, b) = put(t.head_x_m[i], t.head_y_m[i], [1.5e-4, 2e-4], [ar[4], ar[5]], lost[1]);
        out.head_x_m[i] = a; out.head_y_m[i] = b;
    }
    wiperlab::recording::Recording::new("hard", r.grid(), out, true).unwrap()
}
