//! The query of a URL: `a=b&c=d`, values percent-encoded.

use super::error::AddressProblem;

/// The options of `query` in the order written: name and, where there is an `=`, the raw value.
pub(super) fn pairs(query: &str) -> impl Iterator<Item = (&str, Option<&str>)> {
    let pieces = query.split('&').filter(|piece| !piece.is_empty());
    pieces.map(|piece| match piece.split_once('=') {
        Some((name, value)) => (name, Some(value)),
        None => (piece, None),
    })
}

/// The value of option `name` with its `%XX` made bytes again.
pub(super) fn decode(name: &'static str, value: &str) -> Result<String, AddressProblem> {
    let bad = || AddressProblem::BadEscape(name);
    let mut pieces = value.split('%');
    let mut bytes = pieces.next().unwrap_or_default().as_bytes().to_vec();
    for piece in pieces {
        let (digits, rest) = piece.split_at_checked(2).ok_or_else(bad)?;
        if !digits.bytes().all(|byte| byte.is_ascii_hexdigit()) {
            return Err(bad());
        }
        bytes.push(u8::from_str_radix(digits, 16).map_err(|_| bad())?);
        bytes.extend_from_slice(rest.as_bytes());
    }
    String::from_utf8(bytes).map_err(|_| bad())
}

/// `value` such that it can stand in a query, as one word.
pub(super) fn encode(value: &str) -> String {
    let mut encoded = String::new();
    for c in value.chars() {
        if matches!(c, '%' | '&') || c.is_whitespace() || c.is_control() {
            for byte in c.encode_utf8(&mut [0; 4]).bytes() {
                encoded.push_str(&format!("%{byte:02X}"));
            }
        } else {
            encoded.push(c);
        }
    }
    encoded
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_query_is_cut_at_ampersands_and_first_equal_signs() {
        let pairs: Vec<_> = pairs("a=b&c&&d==?&=").collect();
        let expected = [("a", Some("b")), ("c", None), ("d", Some("=?")), ("", Some(""))];
        assert_eq!(pairs, expected);
    }

    #[test]
    fn what_is_encoded_is_decoded() {
        for value in ["", "gcs", "50 % & more", "ä\u{3000}€", "%25", "[fe80::1%wlan0]:1"] {
            assert_eq!(decode("name", &encode(value)).as_deref(), Ok(value));
        }
        assert_eq!(encode("a b%&ä"), "a%20b%25%26ä");
        assert_eq!(decode("name", "a%2fb%C3%A4").as_deref(), Ok("a/bä"));
    }

    #[test]
    fn a_bad_escape_is_refused() {
        for value in ["%", "%2", "%zz", "%+1", "%ff", "%äb", "a%", "%%25"] {
            assert_eq!(decode("name", value), Err(AddressProblem::BadEscape("name")));
        }
    }
}
