//! Analyses a recording for its first scene and first job.

use super::stroke::{EstimatedStroke, KnownStroke, Stroke, estimate_stroke};
use crate::recording::channel::{Channel, Reversal, ReversalInstants, Window, mean_speed_m_per_s};
use crate::recording::{FrameGrid, Recording};
use crate::simulate::drive::{EVEN_SPEED_SHARE, UNCERTAIN_END_S, smooth_head_motion};
use crate::text::{
    format_digits, format_milliseconds, format_speed, format_with_sd, join_with_and, pluralise,
};
use short_spectra::{Component, ComponentVerdict, SpectrumSettings};

/// Motion of the head in the scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum DraftHead {
    /// The motion of the head in the recording.
    Recorded,
    /// A cosine of the time on the clock of the recording.
    Cosine { stroke: Stroke },
}

/// A spectral component that a job can compare.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct DraftComponent {
    /// Name in the job.
    pub name: &'static str,
    /// Channel in which it was found.
    pub channel: Channel,
    /// Window in the notation of a job, such as `release+0.01..release+0.1`.
    pub window: String,
    pub frequency_hz: f64,
    /// Standard deviation of the frequency, Hz.
    pub sd_hz: f64,
    pub amplitude_m: f64,
    /// Band of the component in the job, Hz.
    pub band_hz: [f64; 2],
}

/// Reason why nothing can be drafted for a recording.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{0}")]
pub(crate) struct DraftError(String);

impl DraftError {
    pub(super) fn new(problem: &str) -> Self {
        Self(problem.to_owned())
    }
}

/// Findings in a recording on which a draft is based.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct DraftFindings {
    /// Name of the recording.
    pub name: String,
    pub synthetic: bool,
    pub frames: usize,
    pub frame_rate_hz: f64,
    /// Whether the vertical motion of the head was tracked.
    pub drop: bool,
    /// Reversals of the head.
    pub reversals: Vec<Reversal>,
    /// Maximum speed, m/s, of the head, or of the tip if the head was not tracked.
    pub greatest_speed_m_per_s: f64,
    /// Start and end of the simulated run, s.
    pub run_s: [f64; 2],
    /// Start and end of the fitted part of the recording, s; `None` for the whole recording.
    pub fitted_s: Option<[f64; 2]>,
    /// Number, counted from 1, of the first reversal after which the tip sticks and then slips again. If
    /// there is no such reversal, number of the first reversal after which the tip slips.
    pub shown: Option<usize>,
    /// Components after reversal `shown`.
    pub components: Vec<DraftComponent>,
    pub(super) head: DraftHead,
}

/// A tracked point is used only if it is tracked in at least this fraction of the frames.
const LEAST_TRACKED_SHARE: f64 = 0.5;
/// Minimum travel of the head, m, for which a draft is made. It is a few pixels of the usual size of 20 um.
const LEAST_TRAVEL_M: f64 = 5e-5;
/// Interval between the sampled speeds, s. Each speed is averaged over twice this time, a few cycles of
/// chatter.
const SPEED_S: f64 = 5e-3;
/// Maximum number of frames of a first fit, so that it ends within minutes.
const MOST_FITTED: usize = 12_000;
/// Fraction of the fitted frames that precede the first reversal.
const SHARE_BEFORE_REVERSAL: f64 = 0.3;
/// Lower and upper limit of the band of a component in a job, divided by the frequency of the component.
const BAND_FACTORS: [f64; 2] = [0.6, 1.5];
/// Upper limit of the frequency of a component in a draft, as a fraction of the Nyquist frequency. Above this
/// limit, the exposure and the tracker attenuate an oscillation too much.
const HIGHEST_SHARE: f64 = 0.8;
/// Frequency, Hz, that separates the ring-down of the head (78 Hz in the paper) from the stick-slip cycle
/// (about 900 Hz).
const BETWEEN_HZ: f64 = 250.0;
/// Largest relative standard deviation allowed for the frequency of a component in a job.
const MOST_RELATIVE_SD: f64 = 0.05;
/// Lower limit of the frequency of a component, Hz; the frequency of the stroke is lower.
const LOWEST_HZ: f64 = 10.0;

/// Maximum number of reversals that the findings list one by one.
const MOST_TURNS: usize = 6;

/// Components to look for after a reversal: name, channel, start and end of the window relative to the
/// release, s, and whether the frequency is below [`BETWEEN_HZ`].
const WANTED_COMPONENTS: [(&str, Channel, [&str; 2], bool); 3] = [
    ("low", Channel::HeadDrop, ["+0.01", "+0.2"], true),
    ("high", Channel::Deflection, ["+0.01", "+0.1"], false),
    ("high at speed", Channel::Deflection, ["+0.2", "+0.3"], false),
];

impl DraftFindings {
    /// Analyses a recording; `known` is the stroke of a head that was not tracked.
    ///
    /// # Errors
    /// [`DraftError`] if no job could use the recording.
    pub(crate) fn from_recording(
        recording: &Recording,
        exposure_s: Option<f64>,
        known: KnownStroke,
    ) -> Result<Self, DraftError> {
        let recording = &*recording.resample_to_grid();
        let (grid, traces) = (recording.grid(), recording.traces());
        let tracked = |column: &[Option<f64>]| column.iter().flatten().count();
        let enough =
            |column: &[Option<f64>]| tracked(column) as f64 >= LEAST_TRACKED_SHARE * grid.frames as f64;
        let frames = grid.frames;
        if !enough(&traces.tip_x_m) {
            return Err(DraftError(format!(
                "found the tip's x in {} of {frames} frames, expected it in most of them; track the tip of the lip, as a fit follows it",
                tracked(&traces.tip_x_m)
            )));
        }
        let no_head = DraftError(format!(
            "found the head's x in {} of {frames} frames, and a tip that does not slide both ways; expected a head to drive the model: track a point of the head, or film a reversal",
            tracked(&traces.head_x_m)
        ));
        if !enough(&traces.head_x_m) {
            let EstimatedStroke { stroke, .. } = estimate_stroke(recording, known).ok_or(no_head)?;
            let span_s = [grid.start_s, grid.time_s(grid.frames.saturating_sub(1))];
            return Ok(Self {
                head: DraftHead::Cosine { stroke },
                ..Self::from_driving_trace(recording, exposure_s, &traces.tip_x_m, span_s)
            });
        }
        if known != KnownStroke::default() {
            let why = "found a head that was tracked, and --amplitude-m or --frequency-hz beside it; leave them out: the recorded head drives the model";
            return Err(DraftError(why.to_owned()));
        }
        let head = traces.head_x_m.iter().flatten();
        let [low, high] = head.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(*x), b.max(*x)]);
        if high - low < LEAST_TRAVEL_M {
            return Err(DraftError(format!(
                "found a head that moves by {} m, expected one that moves by more than {LEAST_TRAVEL_M} m; is the scale of the import right?",
                high - low
            )));
        }
        let span_s = smooth_head_motion(recording).map_err(|_| no_head)?.span_s();
        Ok(Self {
            drop: enough(&traces.head_y_m),
            ..Self::from_driving_trace(recording, exposure_s, &traces.head_x_m, span_s)
        })
    }

    /// Findings for a model that is simulated between two times, s; `moving` is the position of the head or,
    /// if the head was not tracked, of the tip.
    fn from_driving_trace(
        recording: &Recording,
        exposure_s: Option<f64>,
        moving: &[Option<f64>],
        [first_s, last_s]: [f64; 2],
    ) -> Self {
        let grid = recording.grid();
        let instants = ReversalInstants::find_instants(recording);
        let reversals = &instants.reversals;
        let speeds = sample_speeds(grid, moving);
        let greatest = speeds.iter().map(|(_, speed)| *speed).fold(0.0, f64::max);
        let resting = |time_s: f64| {
            reversals.iter().any(|r| {
                let from = r.hold_s.unwrap_or(f64::NEG_INFINITY).min(r.reversal_s) - SPEED_S;
                let to = r.settling_time_s().or(r.release_s).unwrap_or(r.reversal_s) + SPEED_S;
                (from..=to).contains(&time_s)
            })
        };
        let even = |(time_s, speed): &(f64, f64)| {
            *speed >= EVEN_SPEED_SHARE * greatest && *time_s >= first_s + UNCERTAIN_END_S && !resting(*time_s)
        };
        let start_s = speeds.into_iter().find(even).map_or(first_s, |(time_s, _)| time_s);
        let shown = reversals.iter().position(|r| r.hold_s.is_some() && r.release_s.is_some());
        let shown = shown.or_else(|| reversals.iter().position(|r| r.release_s.is_some())).map(|at| at + 1);
        Self {
            name: recording.name().to_owned(),
            synthetic: recording.is_synthetic(),
            frames: grid.frames,
            frame_rate_hz: grid.frame_rate_hz,
            drop: false,
            greatest_speed_m_per_s: greatest,
            run_s: [start_s, last_s - UNCERTAIN_END_S].map(round_time_s),
            fitted_s: choose_fit_window(grid.frames, [grid.start_s, grid.time_s(grid.frames)], reversals),
            components: shown
                .map_or_else(Vec::new, |at| find_components(recording, exposure_s, &instants, at)),
            shown,
            reversals: instants.reversals,
            head: DraftHead::Recorded,
        }
    }

    /// Remark that a recording is synthetic.
    pub(super) fn synthetic_note(&self) -> Option<&'static str> {
        self.synthetic.then_some("The recording is synthetic: no camera took it.")
    }

    /// Length of the recording, s.
    pub(crate) fn length_s(&self) -> f64 {
        self.frames as f64 / self.frame_rate_hz
    }

    /// The findings as sentences.
    pub(crate) fn describe(&self) -> Vec<String> {
        let rate = format_digits(self.frame_rate_hz, 4);
        let moving = if self.head == DraftHead::Recorded { "the head" } else { "the tip" };
        let (frames, speed) = (self.frames, format_speed(self.greatest_speed_m_per_s));
        let mut words = vec![format!("{frames} frames at {rate} frames/s; {moving} moves at up to {speed}")];
        if let DraftHead::Cosine { stroke, .. } = self.head {
            words.push(format!(
                "no head; a stroke with an amplitude of {} mm at {} Hz, from the tip",
                format_digits(1e3 * stroke.amplitude_m, 4),
                format_digits(stroke.frequency_hz, 4)
            ));
            return words;
        }
        words.push(match self.reversals.len() {
            0 => "no reversal".to_owned(),
            count => {
                let mut turns: Vec<String> =
                    self.reversals.iter().take(MOST_TURNS).map(describe_reversal).collect();
                turns.extend((count > MOST_TURNS).then(|| format!("{} more", count - MOST_TURNS)));
                format!("{count} {}: {}", pluralise("reversal", count), join_with_and(&turns))
            }
        });
        words.extend(self.components.iter().map(DraftComponent::describe));
        words
    }
}

fn describe_reversal(r: &Reversal) -> String {
    let rest = r
        .release_s
        .map(|release_s| format!(", the tip slips {} later", format_milliseconds(release_s - r.reversal_s)));
    format!("at {:.4} s{}", r.reversal_s, rest.unwrap_or_default())
}

impl DraftComponent {
    /// The component in words.
    pub(crate) fn describe(&self) -> String {
        format!(
            "{} Hz in the {} ({}), amplitude {}",
            format_with_sd(self.frequency_hz, self.sd_hz),
            self.channel.label(),
            self.window,
            crate::text::format_length(self.amplitude_m)
        )
    }
}

/// Rounds a time, s, to 0.1 ms.
fn round_time_s(time_s: f64) -> f64 {
    (1e4 * time_s).round() / 1e4
}

/// Times, s, and mean speeds of a point, m/s, once per [`SPEED_S`] of the recording.
fn sample_speeds(grid: FrameGrid, moving: &[Option<f64>]) -> Vec<(f64, f64)> {
    let step = ((SPEED_S * grid.frame_rate_hz) as usize).max(2);
    let at = |first: usize| {
        let frames = first..(first + 2 * step).min(grid.frames);
        let middle = grid.time_s(first) + 0.5 * frames.len() as f64 / grid.frame_rate_hz;
        Some((middle, mean_speed_m_per_s(moving, grid.frame_rate_hz, frames)?.abs()))
    };
    (0..grid.frames).step_by(step).filter_map(at).collect()
}

/// Start and end of the part of a long recording that a first fit uses, s; `None` for a short recording.
fn choose_fit_window(frames: usize, [start_s, end_s]: [f64; 2], reversals: &[Reversal]) -> Option<[f64; 2]> {
    if frames <= MOST_FITTED {
        return None;
    }
    let length_s = (end_s - start_s) * MOST_FITTED as f64 / frames as f64;
    let turn_s = reversals.first().map_or(start_s, |r| r.reversal_s);
    let from_s = (turn_s - SHARE_BEFORE_REVERSAL * length_s).clamp(start_s, end_s - length_s);
    Some([round_time_s(from_s), round_time_s(from_s + length_s)])
}

fn find_components(
    recording: &Recording,
    exposure_s: Option<f64>,
    instants: &ReversalInstants,
    reversal: usize,
) -> Vec<DraftComponent> {
    let release = if reversal == 1 { "release".to_owned() } else { format!("release[{reversal}]") };
    let highest_hz = HIGHEST_SHARE * recording.grid().frame_rate_hz / 2.0;
    let found = |(name, channel, [from, to], is_low): (&'static str, Channel, [&str; 2], bool)| {
        let window = format!("{release}{from}..{release}{to}");
        let frames = Window::parse(&window).ok()?.resolve_frames(recording, instants).ok()?;
        let samples = channel.samples(recording);
        let band = if is_low { [LOWEST_HZ, BETWEEN_HZ.min(highest_hz)] } else { [BETWEEN_HZ, highest_hz] };
        let settings = SpectrumSettings { band_hz: Some((band[0], band[1])), ..SpectrumSettings::default() };
        let analysis = recording.analyse_samples(samples.get(frames)?, exposure_s, &settings).ok()?;
        let usable = |c: &Component| {
            let trusted = matches!(c.verdict, ComponentVerdict::Clear | ComponentVerdict::Attenuated)
                || c.range_hz.is_some();
            trusted && c.frequency_sd_hz < MOST_RELATIVE_SD * c.frequency_hz
        };
        let all = analysis.spectrum.components.into_iter().filter(usable);
        let best = all.max_by(|a, b| a.amplitude_m.total_cmp(&b.amplitude_m))?;
        let range = best.range_hz.map_or([best.frequency_hz; 2], |range| [range.low_hz, range.high_hz]);
        let ends = [BAND_FACTORS[0] * range[0], BAND_FACTORS[1] * range[1]];
        let whole = |hz: f64| if hz < 100.0 { hz.round() } else { (hz / 10.0).round() * 10.0 };
        Some(DraftComponent {
            name,
            channel,
            window,
            frequency_hz: best.frequency_hz,
            sd_hz: best.frequency_sd_hz,
            amplitude_m: best.amplitude_m,
            band_hz: [whole(ends[0]).max(band[0]), whole(ends[1].min(highest_hz))],
        })
    };
    WANTED_COMPONENTS.into_iter().filter_map(found).collect()
}
