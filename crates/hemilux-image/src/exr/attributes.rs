//! The attribute list of an OpenEXR header, walked byte by byte: the `exr` crate keeps attributes in a hash map, which
//! loses their order when reading and makes the bytes differ from run to run when writing.
//!
//! A header is a list of `name\0 type\0 length:i32 value`, ended by an empty name; a file of several parts has one
//! header after another, ended by an empty one.

use std::ops::Range;

struct Attribute<'a> {
    name: &'a [u8],
    kind: &'a [u8],
    value: &'a [u8],
    whole: Range<usize>,
}

const MULTIPART: u32 = 1 << 12;

/// The attributes of one part; none when the bytes are no such header.
fn part(bytes: &[u8], wanted: usize) -> Option<Vec<Attribute<'_>>> {
    let flags = u32::from_le_bytes(bytes.get(4..8)?.try_into().ok()?);
    let mut at = 8;
    for number in 0..=wanted {
        let mut list = Vec::new();
        loop {
            let start = at;
            let name = word(bytes, &mut at)?;
            if name.is_empty() {
                break;
            }
            let kind = word(bytes, &mut at)?;
            let length = u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?) as usize;
            at += 4;
            let value = bytes.get(at..at.checked_add(length)?)?;
            at += length;
            list.push(Attribute { name, kind, value, whole: start..at });
        }
        if number == wanted {
            return Some(list);
        }
        if list.is_empty() || flags & MULTIPART == 0 {
            return None;
        }
    }
    None
}

fn word<'a>(bytes: &'a [u8], at: &mut usize) -> Option<&'a [u8]> {
    let rest = bytes.get(*at..)?;
    let end = rest.iter().take(256).position(|&b| b == 0)?;
    *at += end + 1;
    Some(&rest[..end])
}

/// The text attributes of one part in their order, without those the format itself defines.
pub(super) fn texts(bytes: &[u8], number: usize) -> Vec<(String, String)> {
    let list = part(bytes, number).unwrap_or_default();
    let free = |a: &&Attribute| a.kind == b"string" && !matches!(a.name, b"name" | b"type" | b"view");
    let text = |b: &[u8]| String::from_utf8_lossy(b).into_owned();
    list.iter().filter(free).map(|a| (text(a.name), text(a.value))).collect()
}

/// Puts the text attributes of a one-part file in the order of `names`, after the others, which keep theirs but for
/// being sorted by name. Nothing changes its length, so the offsets of the pixels stay valid.
pub(super) fn reorder(bytes: &mut [u8], names: &[&str]) {
    let Some(list) = part(bytes, 0) else { return };
    let (Some(first), Some(last)) = (list.first(), list.last()) else { return };
    let span = first.whole.start..last.whole.end;
    let rank = |a: &Attribute| {
        let own = a.kind == b"string";
        names.iter().position(|n| own && n.as_bytes() == a.name).map_or(0, |i| i + 1)
    };
    let mut order: Vec<&Attribute> = list.iter().collect();
    order.sort_by_key(|a| (rank(a), a.name));
    let sorted: Vec<u8> = order.iter().flat_map(|a| &bytes[a.whole.clone()]).copied().collect();
    bytes[span].copy_from_slice(&sorted);
}
