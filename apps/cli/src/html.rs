//! The report as a page.

use crate::report::Report;

/// A self-contained HTML page; `pictures` are titles and PNG bytes.
pub fn page(report: &Report, pictures: &[(String, Vec<u8>)]) -> String {
    let _ = (report, pictures);
    String::new()
}
