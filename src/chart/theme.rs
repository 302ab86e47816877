//! Light and dark: the style that a figure carries for screens. Without it, as in print, a figure has its
//! light colours.

use super::colours::{Rgb, format_hex};
use std::fmt::Write;

/// Colours on a light ground, and what stands for them on a dark one; every other colour (heat maps, what
/// lies over them) is the same on both. The palette is Okabe and Ito's, lighter on the dark ground in the
/// same order of hues.
const DARK_COLOURS: [(Rgb, Rgb); 13] = [
    ((0xFF, 0xFF, 0xFF), (0x16, 0x16, 0x16)), // ground
    ((0x00, 0x00, 0x00), (0xF0, 0xF0, 0xEE)), // text and black lines
    ((0x33, 0x33, 0x33), (0xB8, 0xB8, 0xB4)), // frame
    ((0xDD, 0xDD, 0xDD), (0x3A, 0x3A, 0x38)), // grid
    ((0xE4, 0xE4, 0xE4), (0x3E, 0x3E, 0x40)), // no value
    ((0x66, 0x66, 0x66), (0xA2, 0xA2, 0xA0)), // hatching
    ((0xC4, 0x82, 0x00), (0xFF, 0xC2, 0x4D)),
    ((0x3A, 0x97, 0xD4), (0x9B, 0xD8, 0xFA)),
    ((0x00, 0x9E, 0x73), (0x2B, 0xC7, 0x9A)),
    ((0x00, 0x72, 0xB2), (0x4A, 0xA3, 0xE6)),
    ((0xD5, 0x5E, 0x00), (0xFF, 0x8A, 0x3D)),
    ((0xCC, 0x79, 0xA7), (0xE5, 0x9C, 0xC6)),
    ((0x80, 0x80, 0x80), (0xA6, 0xA6, 0xA6)),
];

/// A style element that gives every figure on its page the colours of a dark ground where the reader has
/// asked for them.
pub(crate) fn dark_theme_style() -> String {
    let mut rules = String::new();
    for (light, dark) in DARK_COLOURS {
        let (light, dark) = (format_hex(light), format_hex(dark));
        let _ = write!(
            rules,
            "svg [fill=\"{light}\"]{{fill:{dark}}}svg \
                           [stroke=\"{light}\"]{{stroke:{dark}}}"
        ); // (a string takes everything)
    }
    format!("<style>@media screen and (prefers-color-scheme:dark){{{rules}}}</style>\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chart::Colour;
    use crate::chart::colours::contrast;

    #[test]
    fn lines_have_a_contrast_of_three_to_one_on_both_grounds() {
        let [(white, dark_ground), ..] = DARK_COLOURS;
        for colour in Colour::LINES {
            let light = colour.rgb();
            let (_, dark) = DARK_COLOURS.iter().find(|(of, _)| *of == light).unwrap();
            for (line, ground) in [(light, white), (*dark, dark_ground)] {
                let found = contrast(line, ground);
                assert!(found >= 3.0, "{colour:?} on {}: {found:.2}", format_hex(ground));
            }
        }
    }
}
