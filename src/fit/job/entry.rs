//! One component or feature of a job: its keys, checked one by one.

use super::{Band, Channel, Context, Detrend, LEAST_SD_RELATIVE, Refusal, Source, Window, refuse};

/// A component or feature, for messages.
pub(super) struct Entry {
    pub(super) what: String,
}

impl Entry {
    pub(super) fn key(&self, key: &str) -> String {
        format!("{}, `{key}`", self.what)
    }

    pub(super) fn window(&self, text: Option<&str>) -> Result<Window, Refusal> {
        let Some(text) = text else { return refuse(self.key("window"), "missing; expected a window such as \"release+0.02..release+0.20\"") };
        Window::parse(text).or_else(|error| refuse(self.key("window"), error.to_string()))
    }

    pub(super) fn band(
        &self,
        channel: Option<&str>,
        window: Option<&str>,
        band_hz: Option<[f64; 2]>,
        detrend: Option<&str>,
        context: &Context,
    ) -> Result<Band, Refusal> {
        let names = Channel::ALL.map(Channel::name).join(", ");
        let Some(channel) = channel else { return refuse(self.key("channel"), format!("missing; expected one of {names}")) };
        let channel = Channel::parse(channel).or_else(|error| refuse(self.key("channel"), error.to_string()))?;
        let Some([low, high]) = band_hz else { return refuse(self.key("band_hz"), "missing; expected [lowest, highest] frequency") };
        if !(low.is_finite() && high.is_finite() && 0.0 <= low && low < high) {
            return refuse(self.key("band_hz"), format!("found [{low}, {high}], expected 0 <= lowest < highest; exchange or correct them"));
        }
        if let Some(nyquist) = context.nyquist_hz.filter(|nyquist| high > *nyquist) {
            return refuse(
                self.key("band_hz"),
                format!("found [{low}, {high}], expected at most half the camera's frame rate, {nyquist} Hz; lower the band or raise camera.frame_rate_hz"),
            );
        }
        let detrend = detrend.map_or(Ok(Detrend::default()), |text| Detrend::parse(text).or_else(|error| refuse(self.key("detrend"), error.to_string())))?;
        Ok(Band { channel, window: self.window(window)?, band_hz: (low, high), detrend })
    }

    pub(super) fn given(&self, target: f64, sd: f64, sd_key: &str) -> Result<Source, Refusal> {
        if !(target.is_finite() && target != 0.0) {
            return refuse(self.key("target"), format!("found {target}, expected a finite number that is not 0 (residuals are logarithms)"));
        }
        let least = LEAST_SD_RELATIVE * target.abs();
        if !(sd.is_finite() && sd >= least) {
            return refuse(self.key(sd_key), format!("found {sd}, expected a finite number of at least {least:e}"));
        }
        Ok(Source::Given { target, sd })
    }

    pub(super) fn relative_sd(&self, found: f64) -> Result<f64, Refusal> {
        if found.is_finite() && found >= LEAST_SD_RELATIVE {
            return Ok(found);
        }
        refuse(
            self.key("sd_relative"),
            format!("found {found}, expected a finite number of at least {LEAST_SD_RELATIVE:e}; 0.05 means 5 % of the measured value"),
        )
    }

    /// Counted from 0, of a number counted from 1.
    pub(super) fn recording(&self, number: Option<usize>, context: &Context) -> Result<usize, Refusal> {
        let most = context.recordings.max(1);
        match number.unwrap_or(1) {
            number if (1..=most).contains(&number) => Ok(number - 1),
            number => refuse(self.key("recording"), format!("found {number}, expected 1 to {most}: recordings are counted from 1 in the order of the file")),
        }
    }
}
