//! The control line of a View3D file: `C name = value …`, in any order, over one or more lines.

use super::report::Report;

/// What a View3D file asks of the program that computes it. Names as in the file; defaults of View3D 3.3.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// `eps`: tolerance of View3D's adaptive integration.
    pub eps: f64,
    /// `maxU`: most subdivisions of a pair that nothing stands between.
    pub max_u: u32,
    /// `maxO`: most subdivisions of an obstructed pair.
    pub max_o: u32,
    /// `minO`: least subdivisions of an obstructed pair.
    pub min_o: u32,
    /// `row`: number of the only surface whose row is wanted; 0 for all.
    pub row: u32,
    /// `col`: number of the only surface whose column is wanted; 0 for all.
    pub col: u32,
    /// `encl`: whether the surfaces form an enclosure, so that View3D scales rows to sum to one.
    pub encl: bool,
    /// `emit`: whether the factors wanted are Hottel's script-F, with reflections by the emittances.
    pub emit: bool,
    /// `out`: form of View3D's output: 0 text, 1 binary, 2 sparse text (newer versions).
    pub out: u32,
    /// `list`: how much View3D writes of its work, 0 to 3.
    pub list: u32,
}

impl Default for Settings {
    fn default() -> Self {
        Settings { eps: 1e-4, max_u: 12, max_o: 8, min_o: 0, row: 0, col: 0, encl: false, emit: false, out: 0, list: 0 }
    }
}

impl Settings {
    /// Reads the part of a control line behind its letter.
    pub(super) fn read(&mut self, line: usize, text: &str, report: &mut Report) {
        let mut words = text.split(|c: char| c.is_whitespace() || c == '=' || c == ',').filter(|word| !word.is_empty());
        while let Some(name) = words.next() {
            let Some(value) = words.next() else {
                report.error(line, format!("{name} has no value"), "write it as name=value");
                break;
            };
            let number: Option<i64> = value.parse().ok();
            let mut integer = |target: &mut u32| match number {
                // View3D takes what is below zero for zero.
                Some(number) => *target = u32::try_from(number.max(0)).unwrap_or(u32::MAX),
                None => report.error(line, format!("{name} is '{value}'"), "it must be a whole number"),
            };
            match name.to_ascii_lowercase().as_str() {
                "eps" => match value.parse().ok().filter(|eps: &f64| eps.is_finite() && *eps > 0.0) {
                    Some(eps) => self.eps = eps,
                    None => report.error(line, format!("eps is '{value}'"), "it must be a number above 0"),
                },
                "maxu" => integer(&mut self.max_u),
                "maxo" => integer(&mut self.max_o),
                "mino" => integer(&mut self.min_o),
                "row" => integer(&mut self.row),
                "col" => integer(&mut self.col),
                "out" => integer(&mut self.out),
                "list" => integer(&mut self.list),
                "encl" | "emit" => {
                    let mut flag = 0;
                    integer(&mut flag);
                    // As View3D has it, a later 0 does not take back what an earlier line set.
                    *(if name.eq_ignore_ascii_case("encl") { &mut self.encl } else { &mut self.emit }) |= flag != 0;
                }
                // Of View3D's own workings: direction of projection, vertices of temporary polygons, separate tolerances of
                // older versions. They change no meaning.
                "prjd" | "maxv" | "epsu" | "epso" => {}
                "maxd" => {
                    let what = format!("maxD={value} asks to leave out pairs that are farther apart");
                    report.warning(line, what, "all pairs are kept: the setting belongs to uDALES's View3D");
                }
                _ => report.warning(line, format!("'{name}' is no setting of View3D; passed over"), ""),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> (Settings, String) {
        let (mut settings, mut report) = (Settings::default(), Report::new("s"));
        settings.read(7, text, &mut report);
        (settings, report.finish().to_string())
    }

    #[test]
    fn settings_are_read_in_any_order_and_case() {
        let (settings, faults) =
            read("encl=1 LIST = 2,eps=1.e-5\tmaxu=8 maxO=9 mino=1 emit=1 row=3 col=4 out=1 prjD=1");
        let expected = Settings {
            eps: 1e-5,
            max_u: 8,
            max_o: 9,
            min_o: 1,
            row: 3,
            col: 4,
            encl: true,
            emit: true,
            out: 1,
            list: 2,
        };
        assert_eq!((settings, faults.as_str()), (expected, ""));
        assert_eq!(read("").0, Settings::default());
    }

    #[test]
    fn what_is_no_setting_is_named() {
        let (settings, faults) = read("eps=0 row=x speed=11 maxD=50 list=-1 encl");
        assert_eq!(settings, Settings::default());
        let expected = "error: s:7: eps is '0' (it must be a number above 0)\n\
                        error: s:7: row is 'x' (it must be a whole number)\n\
                        warning: s:7: 'speed' is no setting of View3D; passed over\n\
                        warning: s:7: maxD=50 asks to leave out pairs that are farther apart \
                        (all pairs are kept: the setting belongs to uDALES's View3D)\n\
                        error: s:7: encl has no value (write it as name=value)";
        assert_eq!(faults, expected);
    }
}
