//! The maps of a study: what each kind of quantity takes.

use super::as_written;
use super::{Map, Quantity, Refusal, refuse};
use crate::recording::channel::{Channel, Window};
use crate::spectrum::Detrend;
use crate::sweep::Kind;
use crate::sweep::quantity::Band;

/// Names of columns that every table has.
const TAKEN: [&str; 4] = ["status", "stopped_at_s", "missing", "source"];

/// What a kind takes beside its name.
#[derive(Clone, Copy, PartialEq)]
enum Takes {
    Band,
    Window,
    Reversal,
    Nothing,
}

fn takes(kind: Kind) -> Takes {
    match kind {
        Kind::Frequency | Kind::Amplitude | Kind::Rms => Takes::Band,
        Kind::MeanDeflection | Kind::StickFraction | Kind::StickDuration | Kind::Transitions => Takes::Window,
        Kind::ReleaseAfterReversal => Takes::Reversal,
        Kind::ContactLoss | Kind::LeastNormalForce | Kind::Jam | Kind::LeastPainleveIndicator => {
            Takes::Nothing
        }
    }
}

pub(super) fn key(name: &str, key: &str) -> String {
    format!("map `{name}`, `{key}`")
}

pub(super) fn maps(written: &[as_written::Map], nyquist_hz: f64) -> Result<Vec<Map>, Refusal> {
    if written.is_empty() {
        return refuse("map", "found none, expected at least one [[map]]: what is read from every run");
    }
    let maps = written.iter().map(|written| map(written, nyquist_hz)).collect::<Result<Vec<_>, _>>()?;
    for (at, map) in maps.iter().enumerate() {
        let column = map.column();
        if TAKEN.contains(&column.as_str()) {
            return refuse(
                key(&map.name, "name"),
                format!("`{column}` is a column of every table; give the map another name"),
            );
        }
        if let Some(other) = maps.iter().take(at).find(|other| other.slug == map.slug) {
            return refuse(
                key(&map.name, "name"),
                format!(
                    "its file `{}.svg` is that of the map `{}`; give each its own name",
                    map.slug, other.name
                ),
            );
        }
    }
    Ok(maps)
}

fn map(written: &as_written::Map, nyquist_hz: f64) -> Result<Map, Refusal> {
    let slug = slug(&written.name);
    if slug.is_empty() {
        return refuse(
            key(&written.name, "name"),
            "expected a name with letters a to z or digits in it, such as \"high component\": it names a file",
        );
    }
    let range = match written.range {
        Some([low, high]) if !(low.is_finite() && high.is_finite() && low < high) => {
            return refuse(
                key(&written.name, "range"),
                format!("found [{low}, {high}], expected [lowest, highest] in the map's unit; correct them"),
            );
        }
        range => range.map(|[low, high]| (low, high)),
    };
    Ok(Map { name: written.name.clone(), slug, quantity: quantity(written, nyquist_hz)?, range })
}

/// Letters and digits of a name in lower case, with `-` for whatever lies between.
fn slug(name: &str) -> String {
    let words = name.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    words.collect::<Vec<_>>().join("-").to_ascii_lowercase()
}

fn quantity(written: &as_written::Map, nyquist_hz: f64) -> Result<Quantity, Refusal> {
    let takes = takes(written.kind);
    let present = [
        ("channel", written.channel.is_some(), takes == Takes::Band),
        ("band_hz", written.band_hz.is_some(), takes == Takes::Band),
        ("detrend", written.detrend.is_some(), takes == Takes::Band),
        (
            "least_amplitude_m",
            written.least_amplitude_m.is_some(),
            matches!(written.kind, Kind::Frequency | Kind::Amplitude),
        ),
        ("window", written.window.is_some(), matches!(takes, Takes::Band | Takes::Window)),
        ("reversal", written.reversal.is_some(), takes == Takes::Reversal),
    ];
    if let Some((found, ..)) = present.into_iter().find(|(_, found, fits)| *found && !fits) {
        return refuse(key(&written.name, found), "has no meaning for this kind of map; remove it");
    }
    let band = || band(written, nyquist_hz);
    // a share, a duration or a count may be that of the whole run
    let window = || written.window.as_deref().map_or(Ok(Window::WHOLE), |text| parse_window(written, text));
    Ok(match written.kind {
        Kind::Frequency => Quantity::Frequency(band()?),
        Kind::Amplitude => Quantity::Amplitude(band()?),
        Kind::Rms => Quantity::Rms(band()?),
        Kind::MeanDeflection => Quantity::MeanDeflection(needed_window(written)?),
        Kind::ReleaseAfterReversal => Quantity::ReleaseAfterReversal(reversal(written)?),
        Kind::StickFraction => Quantity::StickFraction(window()?),
        Kind::StickDuration => Quantity::StickDuration(window()?),
        Kind::Transitions => Quantity::Transitions(window()?),
        Kind::ContactLoss => Quantity::ContactLoss,
        Kind::LeastNormalForce => Quantity::LeastNormalForce,
        Kind::Jam => Quantity::Jam,
        Kind::LeastPainleveIndicator => Quantity::LeastPainleveIndicator,
    })
}

fn parse_window(written: &as_written::Map, text: &str) -> Result<Window, Refusal> {
    Window::parse(text).or_else(|error| refuse(key(&written.name, "window"), error.to_string()))
}

fn needed_window(written: &as_written::Map) -> Result<Window, Refusal> {
    match &written.window {
        Some(text) => parse_window(written, text),
        None => refuse(
            key(&written.name, "window"),
            "missing; expected a window such as \"release+0.02..release+0.20\"",
        ),
    }
}

fn reversal(written: &as_written::Map) -> Result<usize, Refusal> {
    match written.reversal.unwrap_or(1) {
        0 => refuse(key(&written.name, "reversal"), "found 0, expected 1 or more: the first reversal is 1"),
        reversal => Ok(reversal),
    }
}

fn band(written: &as_written::Map, nyquist_hz: f64) -> Result<Band, Refusal> {
    let key = |name: &str| key(&written.name, name);
    let names = Channel::ALL.map(Channel::name).join(", ");
    let Some(channel) = &written.channel else {
        return refuse(key("channel"), format!("missing; expected one of {names}"));
    };
    let channel = Channel::parse(channel).or_else(|error| refuse(key("channel"), error.to_string()))?;
    let Some([low, high]) = written.band_hz else {
        return refuse(key("band_hz"), "missing; expected [lowest, highest] frequency");
    };
    if !(low.is_finite() && high.is_finite() && 0.0 <= low && low < high) {
        return refuse(
            key("band_hz"),
            format!("found [{low}, {high}], expected 0 <= lowest < highest; exchange or correct them"),
        );
    }
    if high > nyquist_hz {
        let expected = format!(
            "expected at most half the camera's frame rate, {nyquist_hz} Hz; lower the band or raise camera.frame_rate_hz"
        );
        return refuse(key("band_hz"), format!("found [{low}, {high}], {expected}"));
    }
    let parsed = written.detrend.as_deref().map_or(Ok(Detrend::default()), Detrend::parse);
    let detrend = parsed.or_else(|error| refuse(key("detrend"), error.to_string()))?;
    let least_amplitude_m = written.least_amplitude_m.unwrap_or(0.0);
    if !(least_amplitude_m.is_finite() && least_amplitude_m >= 0.0) {
        return refuse(
            key("least_amplitude_m"),
            format!("found {least_amplitude_m}, expected a finite number of 0 or more, in m"),
        );
    }
    Ok(Band { channel, window: needed_window(written)?, band_hz: (low, high), detrend, least_amplitude_m })
}
