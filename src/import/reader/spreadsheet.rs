//! Recognises cells in which a spreadsheet has damaged a number when it saved the table. It writes dates,
//! separators of thousands, `####` in a column that is too narrow, and errors of formulas.

const DATE: &str = "a spreadsheet has made a date of the number, and the number is lost: import the tracking \
    program's own export, which no spreadsheet has saved";
const GROUPED: &str = "a spreadsheet has put separators of thousands into the number, perhaps for its decimal mark: \
    import the tracking program's own export, which no spreadsheet has saved";
const HIDDEN: &str = "a spreadsheet wrote the marks of a column that is too narrow for its number: import the \
    tracking program's own export, or widen the column there and save a copy";
const FAILED: &str = "a spreadsheet wrote the error of a formula: import the tracking program's own export, or save \
    a copy with the values";

/// Beginnings of month names in the languages of the supported programs, in lower case.
const MONTHS: [&str; 5] = [
    "jan feb mar apr may jun jul aug sep oct nov dec", // English
    "m\u{e4}r mai okt dez f\u{e9}v fev avr juin juil ao\u{fb} d\u{e9}c", // German, French
    "ene abr ago dic",                                 // Spanish
    "gen mag giu lug set ott",                         // Italian
    "mrt mei out",                                     // Dutch, Portuguese
];
/// Maximum number of letters in an abbreviated name of a month.
const LONGEST_MONTH: usize = 4;
/// Characters that separate day, month and year in a date.
const DATE_MARKS: [char; 6] = ['.', '-', '/', ' ', '\'', ','];

/// Describes how a spreadsheet has damaged the number in a cell, with advice; `None` if the text shows no
/// such damage.
pub(crate) fn describe_damage(text: &str) -> Option<&'static str> {
    let signs: [(bool, &str); 4] = [
        (is_hidden(text), HIDDEN),
        (is_error(text), FAILED),
        (names_month(text) || is_numeric_date(text), DATE),
        (is_grouped(text), GROUPED),
    ];
    signs.into_iter().find_map(|(shown, words)| shown.then_some(words))
}

pub(crate) fn is_hidden(text: &str) -> bool {
    text.len() > 1 && text.bytes().all(|byte| byte == b'#')
}

pub(crate) fn is_error(text: &str) -> bool {
    text.starts_with('#') && text.ends_with(['!', '?']) && !text.contains(char::is_whitespace)
}

/// Whether a text is a date with the name of a month, such as `01.jan`, `Jan 01`, `12.Mai` or `1-Feb-2024`.
fn names_month(text: &str) -> bool {
    let plain = |c: char| c.is_ascii_digit() || DATE_MARKS.contains(&c);
    let mut words = text.split(plain).filter(|word| !word.is_empty());
    let (Some(word), None) = (words.next(), words.next()) else { return false };
    let word = word.to_lowercase();
    text.contains(|c: char| c.is_ascii_digit())
        && word.chars().count() <= LONGEST_MONTH
        && MONTHS.iter().flat_map(|months| months.split(' ')).any(|month| word.starts_with(month))
}

/// Whether a text is a date of numbers only, such as `01/05`, `1.5.2024` or `2024-05-01`. A date with points
/// or hyphens must contain a year, because these characters also occur in numbers.
fn is_numeric_date(text: &str) -> bool {
    let by = |mark: char| -> Option<Vec<u32>> { text.split(mark).map(|part| part.parse().ok()).collect() };
    let day_and_month = |a: u32, b: u32| (1..=31).contains(&a.max(b)) && (1..=12).contains(&a.min(b));
    let year = |part: u32| (1900..=2100).contains(&part);
    ['/', '.', '-'].into_iter().any(|mark| match by(mark).as_deref() {
        Some([a, b]) => mark == '/' && day_and_month(*a, *b),
        Some([a, b, c]) => {
            (year(*c) && day_and_month(*a, *b)) || (year(*a) && day_and_month(*b, *c)) || mark == '/'
        }
        _ => false,
    })
}

/// Whether a text is a number with separators of thousands, such as `1'234.5`, `1,234.5`, `1.234,5`,
/// `12,34,567` or `1.234.567`.
fn is_grouped(text: &str) -> bool {
    let marks = |c: char| text.chars().filter(|other| *other == c).count();
    let digits = text.chars().all(|c| {
        c.is_ascii_digit()
            || matches!(c, '-' | '+' | '.' | ',' | ' ' | '\'' | '\u{a0}' | '\u{202f}' | '\u{2019}')
    });
    let thousands = || marks('.') > 1 && text.split('.').skip(1).all(|group| group.len() == 3);
    let several = (marks('.') > 0 && marks(',') > 0) || marks(',') > 1 || thousands();
    digits && (several || text.contains([' ', '\'', '\u{a0}', '\u{202f}', '\u{2019}']))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_spreadsheet_did_is_named() {
        let cases: [(&str, &[&str]); 4] = [
            (
                DATE,
                &[
                    "01.jan",
                    "Jan 01",
                    "12.Mai",
                    "1-Feb-2024",
                    "M\u{e4}r 05",
                    "15-Sept",
                    "01/05",
                    "1.5.2024",
                    "2024-05-01",
                    "5/1/24",
                    "1.Jan",
                ],
            ),
            (
                GROUPED,
                &["1,234.5", "1.234,5", "12,34,567", "1'234.5", "1\u{202f}234.5", "-1 234.5", "1.234.567"],
            ),
            (HIDDEN, &["#####", "##"]),
            (FAILED, &["#REF!", "#WERT!", "#DIV/0!", "#NAME?"]),
        ];
        for (words, texts) in cases {
            for text in texts {
                assert_eq!(describe_damage(text), Some(words), "{text}");
            }
        }
        for text in ["1,5", "1.2.3", "lost", "Tip 1", "a 1,2,3", "", "#", "marker 3", "32.1.x", "maybe"] {
            assert_eq!(describe_damage(text), None, "{text}");
        }
    }

    #[test]
    fn no_way_out_loses_data() {
        for words in [DATE, GROUPED, HIDDEN, FAILED] {
            assert!(words.contains("import the tracking program's own export"), "{words}");
            assert!(
                !["remove", "delete", "empty", "replace"].iter().any(|verb| words.contains(verb)),
                "{words}"
            );
        }
    }
}
