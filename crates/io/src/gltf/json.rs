//! Reading numbers and lists out of JSON that may hold anything.

use serde_json::Value;

/// A whole number of at least 0. `3.0` counts: some exporters write every number with a fraction.
pub(crate) fn whole(value: &Value) -> Option<usize> {
    if let Some(number) = value.as_u64() {
        return usize::try_from(number).ok();
    }
    // Above 2^53 a fraction says nothing any more.
    let number = value.as_f64()?;
    (number.fract() == 0.0 && (0.0..9.0e15).contains(&number)).then_some(number as usize)
}

/// A finite number; serde_json reads `1e999` as an error, but a caller's own JSON may hold what it likes.
pub(crate) fn number(value: &Value) -> Option<f64> {
    value.as_f64().filter(|x| x.is_finite())
}

/// Exactly `N` finite numbers.
pub(crate) fn numbers<const N: usize>(value: &Value) -> Option<[f64; N]> {
    let list = value.as_array().filter(|list| list.len() == N)?;
    let mut out = [0.0; N];
    for (slot, value) in out.iter_mut().zip(list) {
        *slot = number(value)?;
    }
    Some(out)
}

/// The list under `name`; empty where there is none.
pub(crate) fn list<'a>(value: &'a Value, name: &str) -> &'a [Value] {
    value.get(name).and_then(Value::as_array).map_or(&[], Vec::as_slice)
}

/// The text under `name`; empty where there is none.
pub(crate) fn text<'a>(value: &'a Value, name: &str) -> &'a str {
    value.get(name).and_then(Value::as_str).unwrap_or_default()
}

/// A value shortened for a message.
pub(crate) fn shown(value: Option<&Value>) -> String {
    let Some(value) = value else { return "missing".to_owned() };
    let mut text = match value {
        Value::Array(list) => format!("a list of {}", list.len()),
        Value::Object(_) => "an object".to_owned(),
        other => other.to_string(),
    };
    if text.chars().count() > 40 {
        text = text.chars().take(40).chain(['…']).collect();
    }
    text
}
