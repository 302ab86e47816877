//! Stationary autoregressive noise, `n_t = sum phi_i n_(t-i) + e_t` with white `e`.

/// Most coefficients of a process.
pub const MOST_COEFFICIENTS: usize = 8;

/// Stationary autoregressive noise of a channel.
#[derive(Debug, Clone, PartialEq)]
pub struct AutoregressiveNoise {
    sd: f64,
    coefficients: Vec<f64>,
}

/// Coefficients of which no stationary noise comes.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error(
    "found a standard deviation of {sd} and the coefficients {coefficients:?} of noise, expected a positive number and at most {MOST_COEFFICIENTS} coefficients of a stationary process"
)]
pub struct NotStationary {
    /// Standard deviation.
    pub sd: f64,
    /// Coefficients.
    pub coefficients: Vec<f64>,
}

impl AutoregressiveNoise {
    /// Noise with this standard deviation, in the unit of its channel, and these coefficients, that of the
    /// frame before first.
    ///
    /// # Errors
    /// [`NotStationary`] unless the standard deviation is positive and the noise stays finite.
    pub fn new(sd: f64, coefficients: Vec<f64>) -> Result<Self, NotStationary> {
        let usable = sd > 0.0 && sd.is_finite() && coefficients.len() <= MOST_COEFFICIENTS;
        if usable && reflection_coefficients(&coefficients).iter().all(|kappa| kappa.abs() < 1.0) {
            Ok(Self { sd, coefficients })
        } else {
            Err(NotStationary { sd, coefficients })
        }
    }

    /// White noise.
    ///
    /// # Errors
    /// [`NotStationary`] unless the standard deviation is positive.
    pub fn white(sd: f64) -> Result<Self, NotStationary> {
        Self::new(sd, Vec::new())
    }

    /// Standard deviation of the noise itself, in the unit of its channel.
    #[must_use]
    pub fn sd(&self) -> f64 {
        self.sd
    }

    /// Coefficients, that of the frame before first; none for white noise.
    #[must_use]
    pub fn coefficients(&self) -> &[f64] {
        &self.coefficients
    }

    /// Standard deviation of what the frames before do not tell of a frame.
    #[must_use]
    pub fn innovation_sd(&self) -> f64 {
        let unexplained: f64 =
            reflection_coefficients(&self.coefficients).iter().map(|kappa| 1.0 - kappa * kappa).product();
        self.sd * unexplained.sqrt()
    }

    /// Correlation of frames 0, 1, ... `count - 1` apart.
    #[must_use]
    pub fn correlations(&self, count: usize) -> Vec<f64> {
        let mut correlations = vec![1.0];
        let (mut known, mut unexplained) = (Vec::new(), 1.0);
        for kappa in reflection_coefficients(&self.coefficients) {
            correlations.push(kappa * unexplained + predict_value(&known, &correlations));
            known = raise_order(&known, kappa);
            unexplained *= 1.0 - kappa * kappa;
        }
        while correlations.len() < count {
            correlations.push(predict_value(&self.coefficients, &correlations));
        }
        correlations.truncate(count);
        correlations
    }
}

/// Sum of coefficients times the latest of a row of values, the last first.
fn predict_value(coefficients: &[f64], values: &[f64]) -> f64 {
    coefficients.iter().zip(values.iter().rev()).map(|(a, b)| a * b).sum()
}

/// Coefficients of one order more by its reflection coefficient (Levinson's recursion; Percival and Walden
/// 1993, section 9.4).
pub(super) fn raise_order(coefficients: &[f64], kappa: f64) -> Vec<f64> {
    let turned = coefficients.iter().rev();
    let mut longer: Vec<f64> = coefficients.iter().zip(turned).map(|(a, b)| a - kappa * b).collect();
    longer.push(kappa);
    longer
}

/// Reflection coefficients, that of the lowest order first: the recursion backwards.
fn reflection_coefficients(coefficients: &[f64]) -> Vec<f64> {
    let mut left = coefficients.to_vec();
    let mut found = Vec::with_capacity(left.len());
    while let Some(kappa) = left.pop() {
        found.push(kappa);
        let turned: Vec<f64> = left.iter().rev().copied().collect();
        left.iter_mut().zip(turned).for_each(|(a, b)| *a = (*a + kappa * b) / (1.0 - kappa * kappa));
    }
    found.reverse();
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_coefficient_is_the_correlation_of_neighbours() {
        let noise = AutoregressiveNoise::new(2.0, vec![0.7]).unwrap();
        let exact = (0..6).map(|lag| 0.7f64.powi(lag));
        assert!(noise.correlations(6).iter().zip(exact).all(|(a, b)| (a - b).abs() < 1e-15));
        assert!((noise.innovation_sd() - 2.0 * 0.51f64.sqrt()).abs() < 1e-15);
    }

    /// `rho_1 = phi_1 / (1 - phi_2)`, and the variance as in Box and Jenkins, equation (3.2.28).
    #[test]
    fn two_coefficients_have_their_closed_form() {
        let (a, b) = (1.1, -0.4);
        let noise = AutoregressiveNoise::new(1.0, vec![a, b]).unwrap();
        let [_, first, second] = noise.correlations(3).try_into().unwrap();
        assert!((first - a / (1.0 - b)).abs() < 1e-15);
        assert!((second - (a * first + b)).abs() < 1e-15);
        let innovation = (1.0 + b) * ((1.0 - b).powi(2) - a * a) / (1.0 - b);
        assert!((noise.innovation_sd().powi(2) - innovation).abs() < 1e-15);
    }

    #[test]
    fn noise_that_grows_is_refused() {
        for coefficients in [vec![1.0], vec![-1.2], vec![1.5, -0.4], vec![f64::NAN], vec![0.0; 9]] {
            assert!(AutoregressiveNoise::new(1.0, coefficients.clone()).is_err(), "{coefficients:?}");
        }
        for sd in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(AutoregressiveNoise::white(sd).is_err(), "{sd}");
        }
    }
}
