//! Guesses what a misspelt name was meant to be.

use crate::arrange::Arrange;

/// Number of letters to insert, delete, replace or swap (with the next) to turn `a` into `b`.
fn distance(a: &[char], b: &[char]) -> usize {
    let mut rows = vec![vec![0; b.len() + 1]; a.len() + 1];
    for i in 0..=a.len() {
        for j in 0..=b.len() {
            rows[i][j] = match (i, j) {
                (0, _) => j,
                (_, 0) => i,
                _ => {
                    let replaced = rows[i - 1][j - 1] + usize::from(a[i - 1] != b[j - 1]);
                    let mut best = replaced.min(rows[i - 1][j] + 1).min(rows[i][j - 1] + 1);
                    if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                        best = best.min(rows[i - 2][j - 2] + 1);
                    }
                    best
                }
            };
        }
    }
    rows[a.len()][b.len()]
}

/// `; did you mean …?` with the nearest of the known names, or nothing where none is near.
pub(crate) fn suggestion<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> String {
    let wanted: Vec<char> = name.chars().take(64).map(|c| c.to_ascii_lowercase()).collect();
    let most = 1 + wanted.len() / 4;
    let mut best: Vec<(usize, &str)> = known
        .map(|k| {
            let letters: Vec<char> = k.chars().take(64).map(|c| c.to_ascii_lowercase()).collect();
            (distance(&wanted, &letters), k)
        })
        .filter(|(d, k)| *d <= most && *d < k.chars().count())
        .collect();
    best.arrange();
    best.dedup();
    let nearest = best.first().map_or(0, |b| b.0);
    best.retain(|b| b.0 == nearest);
    let names: Vec<String> = best.iter().take(3).map(|(_, k)| format!("`{k}`")).collect();
    match names.as_slice() {
        [] => String::new(),
        [one] => format!("; did you mean {one}?"),
        several => format!("; did you mean one of {}?", several.join(", ")),
    }
}
