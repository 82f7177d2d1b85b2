//! Bytes written into an address: `data:[media type][;base64],…` (RFC 2397).

use crate::source::percent_decoded_bytes;
use base64::Engine;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};

/// Base64 as exporters write it: padding may be missing, the unused last bits may be set.
const LENIENT: GeneralPurpose = GeneralPurpose::new(
    &base64::alphabet::STANDARD,
    GeneralPurposeConfig::new()
        .with_decode_padding_mode(DecodePaddingMode::Indifferent)
        .with_decode_allow_trailing_bits(true),
);

/// Media type and bytes of a data address; `None` where `uri` is none, the inner error where it cannot be decoded.
pub(crate) fn decode(uri: &str) -> Option<Result<(String, Vec<u8>), String>> {
    let rest = uri.get(..5).filter(|head| head.eq_ignore_ascii_case("data:")).and(uri.get(5..))?;
    let Some((head, body)) = rest.split_once(',') else {
        return Some(Err("a data address without a comma".to_owned()));
    };
    let (mime, base64) = match head.strip_suffix(";base64") {
        Some(mime) => (mime, true),
        None => (head, false),
    };
    let bytes = if base64 {
        match LENIENT.decode(body) {
            Ok(bytes) => bytes,
            Err(error) => return Some(Err(format!("a data address that is not base64: {error}"))),
        }
    } else {
        percent_decoded_bytes(body)
    };
    let mime = mime.split(';').next().unwrap_or_default().to_ascii_lowercase();
    Some(Ok((mime, bytes)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decodes_what_the_standard_allows() {
        let good = |uri: &str| decode(uri).unwrap().unwrap();
        assert_eq!(good("data:image/png;base64,AQID"), ("image/png".to_owned(), vec![1, 2, 3]));
        assert_eq!(good("data:;base64,AQI"), (String::new(), vec![1, 2]));
        assert_eq!(good("DATA:text/plain;charset=x,a%20b"), ("text/plain".to_owned(), b"a b".to_vec()));
        assert!(decode("data:;base64,@@@@").unwrap().is_err());
        assert!(decode("data:nothing").unwrap().is_err());
        assert!(decode("a.bin").is_none());
        assert!(decode("dät").is_none());
    }
}
