//! Reading of decimal numbers.

/// Maximum number of characters of a number that is read digit by digit: its digits are a whole number below
/// 2^53, which a double holds exactly.
const MOST_CHARACTERS: usize = 15;
/// Powers of ten up to the number of digits of such a number; a double holds each exactly.
const POWERS: [f64; MOST_CHARACTERS + 1] =
    [1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15];

/// Parses a finite number with a decimal point. `inf` and `nan`, which the standard library accepts, are
/// refused.
#[must_use]
pub fn parse_finite(text: &str) -> Option<f64> {
    parse_plain(text.as_bytes()).or_else(|| text.parse::<f64>().ok().filter(|value| value.is_finite()))
}

/// Parses a finite number above 0.
#[must_use]
pub fn parse_positive(text: &str) -> Option<f64> {
    parse_finite(text).filter(|number| *number > 0.0)
}

/// The value of a short number without an exponent, which takes half the time of the standard library's
/// parser. The digits and the power of ten are exact, so that the only rounding is that of their quotient.
fn parse_plain(text: &[u8]) -> Option<f64> {
    let (sign, text) = text.strip_prefix(b"-").map_or((1.0, text), |rest| (-1.0, rest));
    if text.len() > MOST_CHARACTERS {
        return None;
    }
    let append = |number: i64, byte: &u8| match byte.wrapping_sub(b'0') {
        digit @ 0..=9 => Some(10 * number + i64::from(digit)),
        _ => None,
    };
    let point = text.iter().position(|byte| *byte == b'.');
    let (before, after) = text.split_at(point.unwrap_or(text.len()));
    let after = after.get(1..).unwrap_or_default();
    let digits = after.iter().try_fold(before.iter().try_fold(0, append)?, append)?;
    (before.len() + after.len() > 0).then(|| sign * (digits as f64 / POWERS[after.len()]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_those_of_the_standard_library() {
        let mut state = 1_u64;
        let mut draw = |most: u64| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) % most
        };
        for _ in 0..200_000 {
            let text: String = (0..1 + draw(17))
                .map(|_| b"0123456789012345678901234567890123456789.-e+"[draw(44) as usize])
                .map(char::from)
                .collect();
            let expected = text.parse::<f64>().ok().filter(|value| value.is_finite());
            assert_eq!(parse_finite(&text).map(f64::to_bits), expected.map(f64::to_bits), "{text}");
        }
        for text in ["", "-", ".", "-.", "-0", "-0.0", "5.", ".5", "inf", "nan", "1e999", "999999999999999"] {
            let expected = text.parse::<f64>().ok().filter(|value| value.is_finite());
            assert_eq!(parse_finite(text).map(f64::to_bits), expected.map(f64::to_bits), "{text}");
        }
    }
}
