//! Numbers as people write them on a command line, and as they read them.

use crate::input::FormFactors;
use radiosity::Up;

/// A number to some decimals; what rounds to zero has no sign.
pub fn fixed(x: f64, decimals: usize) -> String {
    let text = format!("{x:.decimals$}");
    let is_zero = text.chars().all(|c| "-0.".contains(c));
    if is_zero { text.trim_start_matches('-').to_owned() } else { text }
}

/// Coordinates; what rounds to zero has no sign.
pub fn place(p: [f64; 3]) -> String {
    let [x, y, z] = p.map(|x| fixed(x, 4));
    format!("[{x}, {y}, {z}]")
}

/// A number above zero to two digits, or to its whole ones.
pub fn rough(x: f64) -> String {
    rounded(x, 2)
}

/// An illuminance to four digits, or to its whole ones; next to none by its power of ten.
pub fn level(x: f64) -> String {
    match x {
        x if x >= LEAST_LEVEL => rounded(x, 4),
        x if x > 0.0 => format!("{x:.1e}"),
        x => fixed(x, 0),
    }
}

/// Illuminances below this, lx, are told by a power of ten.
const LEAST_LEVEL: f64 = 1e-4;

/// A number above zero to some digits, or to its whole ones.
fn rounded(x: f64, digits: i32) -> String {
    fixed(x, (f64::from(digits) - 1.0 - x.log10().floor()).clamp(0.0, 20.0) as usize)
}

/// A length of one unit, in metres.
pub fn unit(text: &str) -> Result<f64, String> {
    match text {
        "m" => Ok(1.0),
        "cm" => Ok(0.01),
        "mm" => Ok(0.001),
        "in" => Ok(0.0254),
        "ft" => Ok(0.3048),
        number => positive(number).map_err(|_| "use m, cm, mm, in, ft or a number of metres".to_owned()),
    }
}

/// The zenith's axis.
pub fn up(text: &str) -> Result<Up, String> {
    match text.to_ascii_lowercase().as_str() {
        "y" => Ok(Up::Y),
        "z" => Ok(Up::Z),
        _ => Err("use y or z".to_owned()),
    }
}

/// A finite number above zero.
pub fn positive(text: &str) -> Result<f64, String> {
    text.parse::<f64>().ok().filter(|x| x.is_finite() && *x > 0.0).ok_or_else(|| "use a number above 0".to_owned())
}

/// A place: three finite numbers with commas between.
pub fn point(text: &str) -> Result<[f64; 3], String> {
    let numbers: Vec<f64> =
        text.split(',').filter_map(|x| x.trim().parse().ok()).filter(|x: &f64| x.abs() <= 1e9).collect();
    let is_whole = text.split(',').count() == 3;
    numbers
        .try_into()
        .ok()
        .filter(|_| is_whole)
        .ok_or_else(|| "use three numbers, X,Y,Z, such as 1.5,-2,0.8".to_owned())
}

/// A vertical angle of view, degrees.
pub fn angle(text: &str) -> Result<f64, String> {
    let value = text.parse::<f64>().ok().filter(|x| (1.0..=170.0).contains(x));
    value.ok_or_else(|| "use degrees from 1 to 170".to_owned())
}

/// The least relative error that can be asked for: that of single precision is not far below.
const LEAST_ERROR: f64 = 1e-4;

/// A relative error. A bare 1 is refused, as it may mean 1 % or all of it.
pub fn error(text: &str) -> Result<f64, String> {
    let value = match text.strip_suffix('%') {
        // By its text: 0.7 % is 0.007, not 0.006999999999999999.
        Some(number) => positive(&format!("{}e-2", number.trim_end())),
        None => positive(text).and_then(|x| if x < 1.0 { Ok(x) } else { Err(String::new()) }),
    };
    value.ok().filter(|x| (LEAST_ERROR..=1.0).contains(x)).ok_or_else(|| {
        "use a percentage from 0.01% to 100%, such as 1%, or a fraction below 1, such as 0.01".to_owned()
    })
}

/// A difference of colours: 100 is black against white.
pub fn delta_e(text: &str) -> Result<f64, String> {
    let value = positive(text).ok().filter(|x| (1e-3..=100.0).contains(x));
    value.ok_or_else(|| "use a ΔE from 0.001 to 100, such as 1".to_owned())
}

/// A size in bytes. Units are powers of 1024; a number without one is refused, as it may mean anything.
pub fn bytes(text: &str) -> Result<usize, String> {
    let wrong = || "use a size with its unit, such as 500M or 4G, also written 500MiB or 4GB".to_owned();
    let upper = text.to_ascii_uppercase();
    let short = upper.strip_suffix('B').unwrap_or(&upper);
    let short = short.strip_suffix('I').unwrap_or(short);
    let scales = [('K', 1u64 << 10), ('M', 1 << 20), ('G', 1 << 30), ('T', 1 << 40)];
    let scaled = scales.iter().find_map(|(letter, scale)| Some((short.strip_suffix(*letter)?, *scale)));
    let (number, scale) = scaled.ok_or_else(wrong)?;
    let value = positive(number.trim_end()).map_err(|_| wrong())? * scale as f64;
    if (1.0..=1e15).contains(&value) { Ok(value as usize) } else { Err(wrong()) }
}

/// A method for form factors, or rays.
pub fn form_factors(text: &str) -> Result<FormFactors, String> {
    if text == "rays" {
        return Ok(FormFactors(None));
    }
    text.parse().map(|method| FormFactors(Some(method))).map_err(|error| format!("{error}, or rays"))
}

/// A time in seconds. A number without a unit is refused, as it may mean anything.
pub fn seconds(text: &str) -> Result<f64, String> {
    let scales = [("min", 60.0), ("s", 1.0), ("h", 3600.0)];
    let scaled = scales.iter().find_map(|(unit, scale)| Some((text.strip_suffix(unit)?.trim_end(), *scale)));
    let value = scaled.and_then(|(number, scale)| Some(positive(number).ok()? * scale));
    let wrong = "use a time from 1s to 24h with its unit, s, min or h, such as 60s or 5min";
    value.filter(|s| (1.0..=86_400.0).contains(s)).ok_or_else(|| wrong.to_owned())
}

/// Size of a picture, WIDTHxHEIGHT.
pub fn size(text: &str) -> Result<(u32, u32), String> {
    let wrong = || "use WIDTHxHEIGHT, e.g. 1280x720, each from 1 to 16384".to_owned();
    let (w, h) = text.split_once('x').ok_or_else(wrong)?;
    let side = |t: &str| t.parse::<u32>().ok().filter(|n| (1..=16384).contains(n)).ok_or_else(wrong);
    Ok((side(w)?, side(h)?))
}

/// An exposure in EV; ±60 spans everything between starlight and the sun's disc several times.
pub fn exposure(text: &str) -> Result<f64, String> {
    let value = text.parse::<f64>().ok().filter(|x| (-60.0..=60.0).contains(x));
    value.ok_or_else(|| "use a number from -60 to 60".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_as_people_write_them() {
        assert_eq!([error("1%"), error("1 %"), error("0.02")], [Ok(0.01), Ok(0.01), Ok(0.02)]);
        assert_eq!([error("100%"), error("0.7%")], [Ok(1.0), Ok(0.007)]);
        for wrong in ["0", "1", "5", "nan", "-1%", "200%", "%", "0.001%", "one"] {
            assert!(error(wrong).is_err(), "{wrong}");
        }
        assert_eq!(
            [bytes("500M"), bytes("4G"), bytes("4GB"), bytes("4gib")],
            [500 << 20, 4 << 30, 4 << 30, 4 << 30].map(Ok)
        );
        for wrong in ["lots", "-1G", "", "4", "4B", "G"] {
            assert!(bytes(wrong).is_err(), "{wrong}");
        }
        assert_eq!([bytes("500MiB"), bytes("4 GB")], [500 << 20, 4 << 30].map(Ok));
        assert_eq!(point("1,-2.5, 3e-1"), Ok([1.0, -2.5, 0.3]));
        for wrong in ["1,2", "1,2,3,4", "1,2,x", "1,2,nan", "1,2,3,", ""] {
            assert!(point(wrong).is_err(), "{wrong}");
        }
        assert_eq!([fixed(-0.004, 2), fixed(-0.006, 2), fixed(-10.0, 0)], ["0.00", "-0.01", "-10"]);
        assert!(angle("50") == Ok(50.0) && angle("0").is_err() && angle("180").is_err());
        assert_eq!(size("1280x720"), Ok((1280, 720)));
        assert_eq!([seconds("60s"), seconds("1.5 min"), seconds("1h")], [Ok(60.0), Ok(90.0), Ok(3600.0)]);
        for wrong in ["60", "s", "-1s", "0.1s", "nan s", "25h", "1m"] {
            assert!(seconds(wrong).is_err(), "{wrong}");
        }
        assert!(size("0x5").is_err() && size("5").is_err());
        assert_eq!(unit("mm"), Ok(0.001));
        assert!(unit("0").is_err());
        assert_eq!([rough(0.000_512_7), rough(0.96), rough(47.31), rough(5236.1)], ["0.00051", "0.96", "47", "5236"]);
        assert_eq!(
            [level(0.0), level(6.233e-11), level(0.051_234_9), level(365.9765), level(27_832.9)],
            ["0", "6.2e-11", "0.05123", "366.0", "27833"]
        );
        assert!(exposure("-7.5").is_ok() && exposure("nan").is_err() && exposure("1e300").is_err());
    }
}
