//! Words, numbers and the few shapes of markup that a page is made of.
//!
//! Figures that do not exist (an infinite bound, a time that is not a number) are called unknown.

use crate::numbers::fixed;

/// A section with its heading.
pub fn section(title: &str, body: &str) -> String {
    format!("<section><h2>{title}</h2>{body}</section>")
}

/// A remark under a figure.
pub fn note(words: &str) -> String {
    format!("<p class=\"note\">{words}</p>")
}

/// Figures in a row: name, value, what it means.
pub fn cards(cards: &[(&str, String, &str)]) -> String {
    let card = |(name, value, meaning): &(&str, String, &str)| {
        format!("<div><dt>{name}</dt><dd>{value}</dd><dd class=\"meaning\">{meaning}</dd></div>")
    };
    format!("<dl class=\"cards\">{}</dl>", cards.iter().map(card).collect::<String>())
}

/// A table of ready markup; the first column names the row.
pub fn table(head: &[&str], rows: &[Vec<String>]) -> String {
    let head: String = head.iter().map(|h| format!("<th scope=\"col\">{h}</th>")).collect();
    let row = |r: &Vec<String>| {
        let cells: String = r[1..].iter().map(|c| format!("<td>{c}</td>")).collect();
        format!("<tr><th scope=\"row\">{}</th>{cells}</tr>", r[0])
    };
    let rows: String = rows.iter().map(row).collect();
    format!(
        "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"table, scrolls sideways\"><table><thead><tr>{head}</tr>\
         </thead><tbody>{rows}</tbody></table></div>"
    )
}

/// Rows of a name, a bar and figures.
pub fn bars(rows: impl IntoIterator<Item = (String, String, Vec<String>)>) -> String {
    let row = |(name, bar, figures): (String, String, Vec<String>)| {
        let cells: String = figures.iter().map(|f| format!("<td>{f}</td>")).collect();
        format!("<tr><th scope=\"row\">{name}</th><td class=\"wide\">{bar}</td>{cells}</tr>")
    };
    format!("<table class=\"bars\"><tbody>{}</tbody></table>", rows.into_iter().map(row).collect::<String>())
}

/// A name with its meaning in small print.
pub fn named(name: &str, meaning: &str) -> String {
    format!("{name}<small>{meaning}</small>")
}

/// Text from outside.
pub fn escape(text: &str) -> String {
    let text = text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    text.replace('"', "&quot;").replace('\'', "&#39;")
}

/// A count with its noun.
pub fn plural(n: usize, noun: &str) -> String {
    format!("{} {noun}{}", count(n), if n == 1 { "" } else { "s" })
}

/// A whole number with narrow spaces between thousands.
pub fn count(n: usize) -> String {
    let digits = n.to_string();
    let mut out = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push('\u{202f}');
        }
        out.push(digit);
    }
    out
}

/// Three significant digits, as a power of ten where that reads better; unknown if not finite.
pub fn number(x: f64) -> String {
    if !x.is_finite() {
        return "unknown".to_owned();
    }
    let sign = if x < 0.0 { "−" } else { "" };
    let size = x.abs();
    let rounded: f64 = format!("{size:.2e}").parse().unwrap_or(size);
    match rounded {
        0.0 => "0".to_owned(),
        1e-3..1e3 => format!("{sign}{rounded}"),
        1e3..1e9 => format!("{sign}{}", count(size.round() as usize)),
        _ => {
            let rounded = if rounded.is_finite() { rounded } else { size };
            let text = format!("{rounded:e}");
            let (digits, power) = text.split_once('e').unwrap_or((&text, "0"));
            let raise = |c: char| "⁰¹²³⁴⁵⁶⁷⁸⁹".chars().nth(c.to_digit(10).unwrap_or(0) as usize).unwrap_or('⁰');
            let power: String = power.chars().map(|c| if c == '-' { '⁻' } else { raise(c) }).collect();
            format!("{sign}{digits}\u{a0}×\u{a0}10{power}")
        }
    }
}

/// A number with its unit.
pub fn with_unit(x: f64, unit: &str) -> String {
    if x.is_finite() { format!("{}\u{a0}{unit}", number(x)) } else { number(x) }
}

/// A share as percent.
pub fn percent(x: f64) -> String {
    with_unit(100.0 * x, "%")
}

/// A share of a whole as percent, to one decimal.
pub fn share(x: f64) -> String {
    match x {
        x if !(100.0 * x).is_finite() => number(f64::NAN),
        x if x > 0.0 && x < 5e-4 => "&lt;\u{202f}0.1\u{a0}%".to_owned(),
        x => format!("{}\u{a0}%", fixed(100.0 * x, 1)),
    }
}

/// Seconds as people say them.
pub fn duration(seconds: f64) -> String {
    match seconds {
        s if (120.0..1e9).contains(&s) => format!("{}\u{a0}min {:02}\u{a0}s", count(s as usize / 60), s as usize % 60),
        s if s > 0.0 && s < 1.0 => with_unit(1e3 * s, "ms"),
        s => with_unit(s, "s"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_well() {
        let expected = ["unknown", "0", "−0.00123", "12 346", "2.2 × 10⁻¹⁶", "1 000"];
        for (x, text) in [f64::INFINITY, -0.0, -0.001234, 12345.6, 2.2e-16, 999.9].into_iter().zip(expected) {
            assert_eq!(number(x).replace(['\u{202f}', '\u{a0}'], " "), text);
        }
        assert_eq!(duration(f64::NAN), "unknown");
        assert_eq!(duration(125.0).replace('\u{a0}', " "), "2 min 05 s");
        assert_eq!(
            [share(0.1234), share(0.0), share(f64::NAN)].map(|s| s.replace('\u{a0}', " ")),
            ["12.3 %", "0.0 %", "unknown"]
        );
    }
}
