//! Words and signs of a formula.

use crate::FieldError;

/// A word or a sign.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Token<'a> {
    Number(f64),
    Name(&'a str),
    /// One of the signs of [`SIGNS`].
    Sign(&'static str),
    End,
}

impl std::fmt::Display for Token<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Token::Number(v) => write!(f, "the number {v}"),
            Token::Name(n) => write!(f, "`{}`", short(n)),
            Token::Sign(s) => write!(f, "`{s}`"),
            Token::End => write!(f, "the end of the text"),
        }
    }
}

/// Longer signs first.
const SIGNS: [&str; 19] =
    ["**", "<=", ">=", "==", "+", "-", "*", "/", "%", "^", "(", ")", ",", "=", "|", "&", "~", "<", ">"];

/// An error at a byte offset of the text.
pub(super) fn error_at(text: &str, at: usize, reason: impl Into<String>) -> FieldError {
    let at = at.min(text.len());
    let printable = |c: char| if c.is_control() { ' ' } else { c };
    let mut before: Vec<char> = text[..at].chars().rev().take_while(|c| *c != '\n').take(40).collect();
    before.reverse();
    let after = text[at..].chars().take_while(|c| *c != '\n').take(30);
    let line: String = before.iter().copied().chain(after).map(printable).collect();
    let caret = " ".repeat(before.len());
    FieldError::Parse {
        reason: reason.into(),
        position: text[..at].chars().count(),
        excerpt: format!("\n    {line}\n    {caret}^"),
    }
}

/// The beginning of a name, for messages.
pub(super) fn short(name: &str) -> &str {
    name.char_indices().nth(60).map_or(name, |(i, _)| &name[..i])
}

fn is_name(c: char) -> bool {
    c.is_alphabetic() || c.is_ascii_digit() || c == '_'
}

/// Whether a text is a name that a formula can use.
pub(super) fn is_identifier(name: &str) -> bool {
    name.chars().all(is_name) && name.chars().next().is_some_and(|c| !c.is_numeric())
}

/// Length in bytes of the number at the start of `s`; 0 where there is none.
fn number_length(s: &str) -> usize {
    let b = s.as_bytes();
    let digits = |mut i: usize| {
        while b.get(i).is_some_and(u8::is_ascii_digit) {
            i += 1;
        }
        i
    };
    let whole = digits(0);
    let mut end = whole;
    if b.get(whole) == Some(&b'.') {
        end = digits(whole + 1);
        if end == 1 {
            return 0;
        }
    } else if whole == 0 {
        return 0;
    }
    if matches!(b.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(b.get(end + 1), Some(b'+' | b'-')));
        let exponent = digits(end + 1 + sign);
        if exponent > end + 1 + sign {
            end = exponent;
        }
    }
    end
}

/// The number that a text is, rounded to the nearest; too large ones are infinite.
pub(crate) fn number(text: &str) -> Option<f64> {
    if crate::SMALL { by_json(text) } else { text.parse().ok() }
}

/// The same by the reader of files, which is there anyway: the standard library's has ten kilobytes of powers of five.
fn by_json(text: &str) -> Option<f64> {
    let (sign, digits) = match text.strip_prefix('-') {
        Some(rest) => (-1.0, rest),
        None => (1.0, text.strip_prefix('+').unwrap_or(text)),
    };
    if digits.is_empty() || number_length(digits) != digits.len() {
        return None;
    }
    // JSON wants a digit on both sides of the point, and no zeros before the first.
    let (mantissa, exponent) = digits.split_at(digits.find(['e', 'E']).unwrap_or(digits.len()));
    let (whole, part) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let whole = whole.trim_start_matches('0');
    let of = |digits: &str| if digits.is_empty() { "0" } else { digits }.to_string();
    let json = of(whole) + "." + &of(part) + exponent;
    Some(sign * serde_json::from_str(&json).unwrap_or(f64::INFINITY))
}

/// The words and signs of a text, each with its first byte; `#` begins a comment.
pub(super) fn tokens(text: &str) -> Result<Vec<(Token<'_>, usize)>, FieldError> {
    let mut all = Vec::new();
    let mut at = 0;
    while let Some(c) = text[at..].chars().next() {
        let rest = &text[at..];
        if c.is_whitespace() {
            at += c.len_utf8();
        } else if c == '#' {
            at += rest.find('\n').unwrap_or(rest.len());
        } else if let n @ 1.. = number_length(rest) {
            let value = number(&rest[..n]).expect("digits, a point and an exponent are a number");
            if !value.is_finite() {
                return Err(error_at(
                    text,
                    at,
                    format!("{} is too large: numbers reach to 1.8e308", &rest[..n]),
                ));
            }
            if let Some(next) = rest[n..].chars().next().filter(|c| is_name(*c) || *c == '.') {
                let reason = if next == '.' {
                    "a number with two points".to_string()
                } else {
                    format!(
                        "expected a sign between {} and `{next}`: write {}*{next}…",
                        &rest[..n],
                        &rest[..n]
                    )
                };
                return Err(error_at(text, at + n, reason));
            }
            all.push((Token::Number(value), at));
            at += n;
        } else if is_name(c) && !c.is_numeric() {
            let n = rest.find(|c| !is_name(c)).unwrap_or(rest.len());
            all.push((Token::Name(&rest[..n]), at));
            at += n;
        } else if c == ';' {
            all.push((Token::Sign(";"), at));
            at += 1;
        } else if let Some(sign) = SIGNS.iter().find(|s| rest.starts_with(**s)) {
            all.push((Token::Sign(sign), at));
            at += sign.len();
        } else {
            let hint = match c {
                '[' | ']' | '{' | '}' => "; use round brackets",
                '−' | '–' => "; use the ASCII minus -",
                '·' | '×' => "; use * to multiply",
                '²' => "; write ^2",
                '³' => "; write ^3",
                '!' => "; use ~ for the complement",
                _ => "",
            };
            return Err(error_at(text, at, format!("unexpected character `{}`{hint}", c.escape_debug())));
        }
    }
    all.push((Token::End, text.len()));
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::by_json;

    #[test]
    fn the_reader_of_files_reads_numbers_as_the_standard_library_does() {
        for text in
            ["0", "7", "007", "1.5", ".5", "5.", "0.1e1", "5.e3", "1e-7", "00.10", "-3", "+2.5e+10", "1e-400"]
        {
            assert_eq!(by_json(text).map(f64::to_bits), text.parse().ok().map(f64::to_bits), "{text}");
        }
        for text in [
            "9007199254740993",
            "2.2250738585072011e-308",
            "179769313486231580793e289",
            "0.30000000000000004",
        ] {
            assert_eq!(by_json(text).map(f64::to_bits), text.parse().ok().map(f64::to_bits), "{text}");
        }
        assert_eq!(by_json("1e400"), Some(f64::INFINITY));
        assert_eq!(["", "-", "x", "1e", "1 ", "--1"].map(by_json), [None; 6]);
    }
}
