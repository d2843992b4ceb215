//! PLY meshes: ascii and binary, any order and type of properties, polygons cut into fans.
//!
//! Read: vertices `x y z`, normals `nx ny nz`, texture coordinates `u v` / `s t` / `texture_u texture_v` /
//! `texture_s texture_t`; faces `vertex_indices` / `vertex_index`. Other elements and properties are skipped. Nothing is
//! allocated by the header's word alone: a count must fit into the bytes that follow.

use crate::geom::{DVec2, DVec3};
use std::fmt;

/// A mesh as the file has it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ply {
    /// Vertices.
    pub positions: Vec<DVec3>,
    /// Normals per vertex, or empty.
    pub normals: Vec<DVec3>,
    /// Texture coordinates per vertex, or empty.
    pub uvs: Vec<DVec2>,
    /// Triangles; indices in range.
    pub triangles: Vec<[u32; 3]>,
    /// Faces of fewer than three vertices, left out.
    pub dropped: usize,
}

/// What is wrong with a file and on which line of it (0: in its body, or as a whole).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlyError {
    /// Line of the header or of an ascii body, from 1; 0: unknown.
    pub line: u32,
    /// One sentence.
    pub message: String,
}

impl fmt::Display for PlyError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

fn fail<T>(line: u32, message: impl Into<String>) -> Result<T, PlyError> {
    Err(PlyError { line, message: message.into() })
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Ascii,
    Little,
    Big,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn parse(word: &str) -> Option<Self> {
        Some(match word {
            "char" | "int8" => Scalar::I8,
            "uchar" | "uint8" => Scalar::U8,
            "short" | "int16" => Scalar::I16,
            "ushort" | "uint16" => Scalar::U16,
            "int" | "int32" => Scalar::I32,
            "uint" | "uint32" => Scalar::U32,
            "float" | "float32" => Scalar::F32,
            "double" | "float64" => Scalar::F64,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Scalar::I8 | Scalar::U8 => 1,
            Scalar::I16 | Scalar::U16 => 2,
            Scalar::I32 | Scalar::U32 | Scalar::F32 => 4,
            Scalar::F64 => 8,
        }
    }
}

#[derive(Clone, Debug)]
struct Property {
    name: String,
    ty: Scalar,
    /// Type of the count, for lists.
    count: Option<Scalar>,
}

#[derive(Clone, Debug)]
struct Element {
    name: String,
    count: usize,
    properties: Vec<Property>,
    line: u32,
}

struct Header {
    format: Format,
    elements: Vec<Element>,
    /// Bytes and lines of the header.
    bytes: usize,
    lines: u32,
}

/// Longest header read.
const MAX_HEADER: usize = 1 << 20;

fn header(data: &[u8]) -> Result<Header, PlyError> {
    if data.is_empty() {
        return fail(0, "empty file");
    }
    let mut at = 0;
    let mut line = 0;
    let mut format = None;
    let mut elements: Vec<Element> = Vec::new();
    loop {
        let limit = data.len().min(MAX_HEADER);
        let Some(length) = data[at..limit].iter().position(|&b| b == b'\n') else {
            if line == 0 && !data.starts_with(b"ply") {
                return fail(0, "not a PLY file");
            }
            return fail(0, "truncated header: no end_header");
        };
        let text = String::from_utf8_lossy(&data[at..at + length]);
        at += length + 1;
        line += 1;
        let words: Vec<&str> = text.split_whitespace().collect();
        if line == 1 {
            if words != ["ply"] {
                return fail(0, "not a PLY file");
            }
            continue;
        }
        match words[..] {
            [] | ["comment", ..] | ["obj_info", ..] => {}
            ["format", name, version] => {
                format = Some(match name {
                    "ascii" => Format::Ascii,
                    "binary_little_endian" => Format::Little,
                    "binary_big_endian" => Format::Big,
                    _ => return fail(line, format!("unknown format \"{name}\"")),
                });
                if version != "1.0" {
                    return fail(line, format!("unknown version \"{version}\""));
                }
            }
            ["element", name, count] => {
                let Ok(count) = count.parse::<usize>() else {
                    return fail(line, format!("\"{count}\" is not a number of {name} elements"));
                };
                elements.push(Element { name: name.into(), count, properties: Vec::new(), line });
            }
            ["property", ref rest @ ..] => {
                let Some(element) = elements.last_mut() else {
                    return fail(line, "property before any element");
                };
                element.properties.push(property(rest, line)?);
            }
            ["end_header"] => {
                let Some(format) = format else { return fail(line, "no format line") };
                return Ok(Header { format, elements, bytes: at, lines: line });
            }
            _ => return fail(line, format!("unknown header line \"{}\"", brief(&text))),
        }
    }
}

fn brief(text: &str) -> String {
    text.trim().chars().take(40).flat_map(char::escape_debug).collect()
}

fn property(words: &[&str], line: u32) -> Result<Property, PlyError> {
    let scalar = |word: &str| match Scalar::parse(word) {
        Some(s) => Ok(s),
        None => fail(line, format!("unknown property type \"{}\"", brief(word))),
    };
    match *words {
        ["list", count, ty, name] => {
            let count = scalar(count)?;
            if matches!(count, Scalar::F32 | Scalar::F64) {
                return fail(line, "the count of a list must be an integer");
            }
            Ok(Property { name: name.into(), ty: scalar(ty)?, count: Some(count) })
        }
        [ty, name] => Ok(Property { name: name.into(), ty: scalar(ty)?, count: None }),
        _ => fail(line, "a property is a type and a name"),
    }
}

/// Delivers the scalars of the body one after another.
trait Source {
    fn scalar(&mut self, ty: Scalar) -> Result<f64, PlyError>;
    /// Bytes not yet read.
    fn remaining(&self) -> usize;
    /// Line, if lines mean anything.
    fn line(&self) -> u32;
}

struct Binary<'a> {
    data: &'a [u8],
    big: bool,
}

fn decode(bytes: &[u8], ty: Scalar, big: bool) -> f64 {
    macro_rules! number {
        ($t:ty) => {{
            let mut raw = [0u8; size_of::<$t>()];
            raw.copy_from_slice(&bytes[..size_of::<$t>()]);
            f64::from(if big { <$t>::from_be_bytes(raw) } else { <$t>::from_le_bytes(raw) })
        }};
    }
    match ty {
        Scalar::I8 => number!(i8),
        Scalar::U8 => number!(u8),
        Scalar::I16 => number!(i16),
        Scalar::U16 => number!(u16),
        Scalar::I32 => number!(i32),
        Scalar::U32 => number!(u32),
        Scalar::F32 => number!(f32),
        Scalar::F64 => number!(f64),
    }
}

impl Source for Binary<'_> {
    #[inline]
    fn scalar(&mut self, ty: Scalar) -> Result<f64, PlyError> {
        if self.data.len() < ty.size() {
            return fail(0, "truncated file");
        }
        let (head, tail) = self.data.split_at(ty.size());
        self.data = tail;
        Ok(decode(head, ty, self.big))
    }

    fn remaining(&self) -> usize {
        self.data.len()
    }

    fn line(&self) -> u32 {
        0
    }
}

struct Ascii<'a> {
    data: &'a [u8],
    line: u32,
}

impl Source for Ascii<'_> {
    fn scalar(&mut self, ty: Scalar) -> Result<f64, PlyError> {
        while let Some((&b, rest)) = self.data.split_first() {
            if !b.is_ascii_whitespace() {
                break;
            }
            self.line += u32::from(b == b'\n');
            self.data = rest;
        }
        let end = self.data.iter().position(u8::is_ascii_whitespace).unwrap_or(self.data.len());
        if end == 0 {
            return fail(0, "truncated file");
        }
        let (word, rest) = self.data.split_at(end);
        self.data = rest;
        let text = std::str::from_utf8(word).unwrap_or("?");
        let value: f64 = match text.parse() {
            Ok(v) => v,
            Err(_) => return fail(self.line, format!("\"{}\" is not a number", brief(text))),
        };
        let float = matches!(ty, Scalar::F32 | Scalar::F64);
        if !float && value.fract() != 0.0 {
            return fail(self.line, format!("\"{}\" is not an integer", brief(text)));
        }
        Ok(value)
    }

    fn remaining(&self) -> usize {
        self.data.len()
    }

    fn line(&self) -> u32 {
        self.line
    }
}

/// What a scalar property of a vertex is: an index into a row of eight.
fn role(name: &str) -> Option<usize> {
    Some(match name {
        "x" => 0,
        "y" => 1,
        "z" => 2,
        "nx" => 3,
        "ny" => 4,
        "nz" => 5,
        "u" | "s" | "texture_u" | "texture_s" => 6,
        "v" | "t" | "texture_v" | "texture_t" => 7,
        _ => return None,
    })
}

/// Read a mesh.
pub fn read(data: &[u8]) -> Result<Ply, PlyError> {
    let header = header(data)?;
    let body = &data[header.bytes..];
    match header.format {
        Format::Ascii => elements(&header, &mut Ascii { data: body, line: header.lines + 1 }),
        Format::Little => elements(&header, &mut Binary { data: body, big: false }),
        Format::Big => elements(&header, &mut Binary { data: body, big: true }),
    }
}

fn elements<S: Source>(header: &Header, source: &mut S) -> Result<Ply, PlyError> {
    let mut mesh = Ply::default();
    let (mut vertices, mut faces) = (false, false);
    for element in &header.elements {
        if element.properties.is_empty() {
            continue;
        }
        fits(element, source.remaining(), header.format)?;
        match element.name.as_str() {
            "vertex" if !vertices => {
                vertices = true;
                read_vertices(element, source, &mut mesh)?;
            }
            "face" if !faces => {
                if !vertices {
                    return fail(element.line, "faces before vertices");
                }
                faces = true;
                read_faces(element, source, &mut mesh)?;
            }
            _ => skip(element, source)?,
        }
    }
    if !vertices || mesh.positions.is_empty() {
        return fail(0, "no vertices");
    }
    if !faces || mesh.triangles.is_empty() {
        return fail(0, "no faces");
    }
    Ok(mesh)
}

/// Refuse a count that the rest of the file cannot hold.
fn fits(element: &Element, remaining: usize, format: Format) -> Result<(), PlyError> {
    let least: usize = element
        .properties
        .iter()
        .map(|p| if format == Format::Ascii { 2 } else { p.count.unwrap_or(p.ty).size() })
        .sum();
    // The last number of an ascii file needs no white space after it.
    let needed = element.count.checked_mul(least).map(|n| n.saturating_sub(1));
    if needed.is_none_or(|n| n > remaining) || element.count > u32::MAX as usize {
        return fail(
            element.line,
            format!(
                "the header announces {} {} elements, the file is too short",
                element.count, element.name
            ),
        );
    }
    Ok(())
}

fn list_length<S: Source>(source: &mut S, count: Scalar, ty: Scalar) -> Result<usize, PlyError> {
    let n = source.scalar(count)?;
    let least = if source.line() > 0 { 1 } else { ty.size() };
    if !(0.0..=source.remaining() as f64).contains(&(n * least as f64)) {
        return fail(source.line(), format!("a list of {n} values, the file is too short"));
    }
    Ok(n as usize)
}

fn skip_property<S: Source>(source: &mut S, p: &Property) -> Result<(), PlyError> {
    let n = match p.count {
        Some(count) => list_length(source, count, p.ty)?,
        None => 1,
    };
    for _ in 0..n {
        source.scalar(p.ty)?;
    }
    Ok(())
}

fn skip<S: Source>(element: &Element, source: &mut S) -> Result<(), PlyError> {
    for _ in 0..element.count {
        for p in &element.properties {
            skip_property(source, p)?;
        }
    }
    Ok(())
}

fn read_vertices<S: Source>(element: &Element, source: &mut S, mesh: &mut Ply) -> Result<(), PlyError> {
    let roles: Vec<Option<usize>> =
        element.properties.iter().map(|p| if p.count.is_some() { None } else { role(&p.name) }).collect();
    let has = |wanted: &[usize]| wanted.iter().all(|w| roles.contains(&Some(*w)));
    if !has(&[0, 1, 2]) {
        return fail(element.line, "vertices without x, y and z");
    }
    let (normals, uvs) = (has(&[3, 4, 5]), has(&[6, 7]));
    mesh.positions.reserve(element.count);
    mesh.normals.reserve(if normals { element.count } else { 0 });
    mesh.uvs.reserve(if uvs { element.count } else { 0 });
    let mut row = [0.0f64; 8];
    for _ in 0..element.count {
        for (p, role) in element.properties.iter().zip(&roles) {
            match role {
                Some(i) => row[*i] = source.scalar(p.ty)?,
                None => skip_property(source, p)?,
            }
        }
        if !row.iter().all(|v| v.is_finite()) {
            let message = format!("vertex {} is not finite", mesh.positions.len());
            return fail(source.line(), message);
        }
        mesh.positions.push(DVec3::new(row[0], row[1], row[2]));
        if normals {
            mesh.normals.push(DVec3::new(row[3], row[4], row[5]));
        }
        if uvs {
            mesh.uvs.push(DVec2::new(row[6], row[7]));
        }
    }
    Ok(())
}

fn read_faces<S: Source>(element: &Element, source: &mut S, mesh: &mut Ply) -> Result<(), PlyError> {
    let list =
        |p: &Property| p.count.is_some() && matches!(p.name.as_str(), "vertex_indices" | "vertex_index");
    let Some(which) = element.properties.iter().position(list) else {
        return fail(element.line, "faces without vertex_indices");
    };
    let vertices = mesh.positions.len();
    mesh.triangles.reserve(element.count);
    for face in 0..element.count {
        for (i, p) in element.properties.iter().enumerate() {
            let (true, Some(count)) = (i == which, p.count) else {
                skip_property(source, p)?;
                continue;
            };
            let n = list_length(source, count, p.ty)?;
            mesh.dropped += usize::from(n < 3);
            let (mut first, mut last) = (0, 0);
            for k in 0..n {
                let index = source.scalar(p.ty)?;
                if !(index >= 0.0 && index < vertices as f64 && index.fract() == 0.0) {
                    let message = format!("face {face} names vertex {index}, there are {vertices}");
                    return fail(source.line(), message);
                }
                let index = index as u32;
                match k {
                    0 => first = index,
                    1 => {}
                    _ => mesh.triangles.push([first, last, index]),
                }
                last = index;
            }
        }
    }
    Ok(())
}
