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
            let value: f64 = rest[..n].parse().expect("digits, a point and an exponent are a number");
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
