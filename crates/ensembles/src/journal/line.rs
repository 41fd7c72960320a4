//! The line of a row.
//!
//! ```text
//! 17 ok span|parameters|figures|end|measures|times|series ~seconds #sum
//! 18 failed start|parameters|figures or nothing|sentence ~seconds #sum
//! 19 passed times|parameters| ~seconds #sum
//! rows 1000 #sum
//! ```
//!
//! The last of these says that the plan has got more rows than before.

use super::Header;
use crate::entry::{Done, ENDINGS, Entry, Failed, Outcome};
use crate::figures::{FIGURES, Figures};
use crate::fingerprint::of_line;

/// The line of a row, with its end.
pub(crate) fn encode(entry: &Entry) -> Vec<u8> {
    let mut line = body(entry);
    line.extend_from_slice(b" ~");
    push(&mut line, entry.seconds);
    end(&mut line);
    line
}

/// Whether two entries of one row hold the same bits; the wall time does not count.
pub(crate) fn same_numbers(a: &Entry, b: &Entry) -> bool {
    body(a) == body(b)
}

/// The part of a line that is compared.
fn body(entry: &Entry) -> Vec<u8> {
    let mut line = Vec::with_capacity(512);
    line.extend_from_slice(entry.number.to_string().as_bytes());
    match &entry.outcome {
        Outcome::Done(done) => {
            line.extend_from_slice(b" ok ");
            line.extend_from_slice(done.ending.as_bytes());
            let Done { figures, end, measures, times, series, .. } = done;
            for list in [&entry.parameters, &figures[..], end, measures, times, series] {
                push_list(&mut line, list);
            }
        }
        Outcome::Failed(Failed { kind, message, figures }) => {
            line.extend_from_slice(b" failed ");
            line.extend_from_slice(kind.as_bytes());
            push_list(&mut line, &entry.parameters);
            push_list(&mut line, figures.as_ref().map_or(&[], |figures| &figures[..]));
            line.push(b'|');
            line.extend_from_slice(escaped(message).as_bytes());
        }
        Outcome::PassedOver(times) => {
            line.extend_from_slice(format!(" passed {times}").as_bytes());
            push_list(&mut line, &entry.parameters);
            push_list(&mut line, &[]);
        }
    }
    line
}

/// The line that says how many rows a plan has now, with its end.
pub(crate) fn encode_rows(rows: usize) -> Vec<u8> {
    let mut line = format!("{ROWS}{rows}").into_bytes();
    end(&mut line);
    line
}

/// The number of rows that a line says; `None` if it is another line.
pub(crate) fn decode_rows(line: &[u8]) -> Option<usize> {
    whole(line)?.strip_prefix(ROWS)?.parse().ok()
}

/// The beginning of the line that says how many rows a plan has now.
const ROWS: &str = "rows ";

/// Ends a line with its check sum.
fn end(line: &mut Vec<u8>) {
    let sum = of_line(line);
    line.extend_from_slice(b" #");
    push_hex(line, sum, 16);
    line.push(b'\n');
}

/// The text of a line without its check sum; `None` if it is torn or changed.
fn whole(line: &[u8]) -> Option<&str> {
    let text = std::str::from_utf8(line).ok()?.strip_suffix('\n')?;
    let (body, sum) = text.rsplit_once(" #")?;
    let is_whole =
        sum.len() == 16 && u64::from_str_radix(sum, 16).ok()? == of_line(body.as_bytes());
    is_whole.then_some(body)
}

fn push_list(line: &mut Vec<u8>, numbers: &[f64]) {
    line.push(b'|');
    for (k, x) in numbers.iter().enumerate() {
        if k > 0 {
            line.push(b' ');
        }
        push(line, *x);
    }
}

/// The hexadecimal digits of a number without the zeros at their end; `0` for zero.
fn push(line: &mut Vec<u8>, x: f64) {
    let bits = x.to_bits();
    push_hex(line, bits, (16 - bits.trailing_zeros() / 4).max(1));
}

/// The first `count` of the 16 digits.
fn push_hex(line: &mut Vec<u8>, bits: u64, count: u32) {
    // A byte for each digit: spread the nibbles of 32 bits over 64, then add '0' or 'a' − 10 to each.
    let mut digits = [0; 16];
    for (half, place) in [bits >> 32, bits & 0xffff_ffff].into_iter().zip([0, 8]) {
        let spread = (half | (half << 16)) & 0x0000_ffff_0000_ffff;
        let spread = (spread | (spread << 8)) & 0x00ff_00ff_00ff_00ff;
        let spread = (spread | (spread << 4)) & 0x0f0f_0f0f_0f0f_0f0f;
        let letters = ((spread + 0x0606_0606_0606_0606) >> 4) & 0x0101_0101_0101_0101;
        let ascii = spread + 0x3030_3030_3030_3030 + letters * 39;
        digits[place..place + 8].copy_from_slice(&ascii.to_be_bytes());
    }
    line.extend_from_slice(&digits[..count as usize]);
}

/// A number from its digits.
fn number(digits: &str) -> Option<f64> {
    let shift = 16_u32.checked_sub(u32::try_from(digits.len()).ok()?)?;
    let bits = u64::from_str_radix(digits, 16).ok()?;
    Some(f64::from_bits(bits << (4 * shift)))
}

fn list(text: &str) -> Option<Box<[f64]>> {
    if text.is_empty() { Some([].into()) } else { text.split(' ').map(number).collect() }
}

/// The row of a line; `None` if it is torn, changed, or no row of this plan.
pub(crate) fn decode(line: &[u8], header: &Header) -> Option<Entry> {
    let (body, seconds) = whole(line)?.rsplit_once(" ~")?;
    let mut parts = body.split('|');
    let mut head = parts.next()?.split(' ');
    let (number_of_row, status, word) = (head.next()?.parse().ok()?, head.next()?, head.next()?);
    let parameters = list(parts.next()?)?;
    let figures = list(parts.next()?)?;
    let outcome = match status {
        "ok" => {
            let ending = ENDINGS.iter().find(|ending| **ending == word)?;
            let mut next = || list(parts.next()?);
            let (end, measures, times, series) = (next()?, next()?, next()?, next()?);
            let fits = measures.len() == header.measures.len()
                && series.len() == times.len() * header.observables.len();
            let figures = Figures::try_from(&*figures).ok().filter(|_| fits)?;
            Outcome::Done(Done { ending, figures, end, measures, times, series })
        }
        "failed" => {
            let message = unescaped(parts.next()?);
            let figures = match figures.len() {
                0 => None,
                _ => Some(Figures::try_from(&*figures).ok()?),
            };
            Outcome::Failed(Failed { kind: word.to_owned(), message, figures })
        }
        "passed" => Outcome::PassedOver(word.parse().ok()?),
        _ => return None,
    };
    let fits = number_of_row < header.rows && parameters.len() == header.parameters.len();
    debug_assert_eq!(FIGURES.len(), size_of::<Figures>() / 8);
    fits.then_some(Entry { number: number_of_row, parameters, outcome, seconds: number(seconds)? })
}

/// A text without spaces, separators or line breaks: these are `%` and their code in two hexadecimal digits.
pub(super) fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match u8::try_from(c) {
            Ok(byte) if byte <= b' ' || byte == 0x7f || b"%|,=#~".contains(&byte) => {
                escaped.push_str(&format!("%{byte:02x}"));
            }
            _ => escaped.push(c),
        }
    }
    escaped
}

/// The text of an escaped one.
pub(super) fn unescaped(text: &str) -> String {
    let mut parts = text.split('%');
    let mut plain = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let code = part.get(..2).and_then(|code| u8::from_str_radix(code, 16).ok());
        match code {
            Some(code) => {
                plain.push(char::from(code));
                plain.push_str(&part[2..]);
            }
            None => plain.push_str(part),
        }
    }
    plain
}
