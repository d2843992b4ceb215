//! PLY: what is printed in any of the three formats, with properties in any order and type, reads back the same.

use hemilux_scene::geom::{DVec2, DVec3};
use hemilux_scene::import::ply::{self, Ply};
use proptest::prelude::*;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Format {
    Ascii,
    Little,
    Big,
}

/// A mesh to print; values are small integers, exact in every type that is used.
#[derive(Clone, Debug)]
struct Sample {
    vertices: Vec<[i8; 8]>,
    faces: Vec<Vec<u8>>,
    /// Order of the vertex properties x y z nx ny nz u v and one that means nothing.
    order: Vec<usize>,
    /// Their types, by index into TYPES.
    types: Vec<usize>,
    normals: bool,
    uvs: bool,
    /// Names of u and v.
    uv_names: usize,
    count_type: usize,
    index_type: usize,
    /// A list property before the indices, another after.
    clutter: bool,
}

const TYPES: [&str; 6] = ["char", "int16", "int", "float", "float64", "int8"];
const COUNTS: [&str; 4] = ["uchar", "ushort", "int32", "uint"];
const INDICES: [&str; 4] = ["uint8", "short", "int", "uint32"];
const UVS: [[&str; 2]; 4] = [["u", "v"], ["s", "t"], ["texture_u", "texture_v"], ["texture_s", "texture_t"]];

fn put(out: &mut Vec<u8>, format: Format, ty: &str, v: i64) {
    macro_rules! bytes {
        ($t:ty) => {
            match format {
                Format::Big => out.extend((v as $t).to_be_bytes()),
                _ => out.extend((v as $t).to_le_bytes()),
            }
        };
    }
    if format == Format::Ascii {
        out.extend(format!("{v} ").bytes());
        return;
    }
    match ty {
        "char" | "int8" => bytes!(i8),
        "uchar" | "uint8" => bytes!(u8),
        "short" | "int16" => bytes!(i16),
        "ushort" => bytes!(u16),
        "int" | "int32" => bytes!(i32),
        "uint" | "uint32" => bytes!(u32),
        "float" => bytes!(f32),
        _ => bytes!(f64),
    }
}

impl Sample {
    fn columns(&self) -> Vec<usize> {
        let wanted = |c: &usize| match c {
            3..=5 => self.normals,
            6..=7 => self.uvs,
            _ => true,
        };
        self.order.iter().copied().filter(wanted).collect()
    }

    fn print(&self, format: Format) -> Vec<u8> {
        let name = match format {
            Format::Ascii => "ascii",
            Format::Little => "binary_little_endian",
            Format::Big => "binary_big_endian",
        };
        let [u, v] = UVS[self.uv_names];
        let names = ["x", "y", "z", "nx", "ny", "nz", u, v, "quality"];
        let mut out =
            format!("ply\nformat {name} 1.0\r\ncomment made up\nelement vertex {}\n", self.vertices.len());
        for c in self.columns() {
            out += &format!("property {} {}\n", TYPES[self.types[c]], names[c]);
        }
        out += &format!("element empty 3\nelement face {}\n", self.faces.len());
        let (count, index) = (COUNTS[self.count_type], INDICES[self.index_type]);
        if self.clutter {
            out += "property list ushort double before\n";
        }
        out += &format!("property list {count} {index} vertex_indices\n");
        if self.clutter {
            out += "property uchar after\n";
        }
        out += "element tail 1\nproperty int z\nend_header\n";
        let mut out = out.into_bytes();
        let end = |out: &mut Vec<u8>| {
            if format == Format::Ascii {
                out.push(b'\n');
            }
        };
        for row in &self.vertices {
            for c in self.columns() {
                put(&mut out, format, TYPES[self.types[c]], row.get(c).map_or(99, |&v| v.into()));
            }
            end(&mut out);
        }
        for face in &self.faces {
            if self.clutter {
                put(&mut out, format, "ushort", 2);
                put(&mut out, format, "double", 5);
                put(&mut out, format, "double", -6);
            }
            put(&mut out, format, count, face.len() as i64);
            face.iter().for_each(|&i| put(&mut out, format, index, i.into()));
            if self.clutter {
                put(&mut out, format, "uchar", 7);
            }
            end(&mut out);
        }
        put(&mut out, format, "int", -1);
        out
    }

    fn expected(&self) -> Ply {
        let v = |i: usize| move |r: &[i8; 8]| f64::from(r[i]);
        let row = |a: usize| self.vertices.iter().map(move |r| DVec3::new(v(a)(r), v(a + 1)(r), v(a + 2)(r)));
        let mut triangles = Vec::new();
        for f in &self.faces {
            for k in 2..f.len() {
                triangles.push([f[0].into(), f[k - 1].into(), f[k].into()]);
            }
        }
        Ply {
            positions: row(0).collect(),
            normals: if self.normals { row(3).collect() } else { Vec::new() },
            uvs: match self.uvs {
                true => self.vertices.iter().map(|r| DVec2::new(v(6)(r), v(7)(r))).collect(),
                false => Vec::new(),
            },
            triangles,
            dropped: self.faces.iter().filter(|f| f.len() < 3).count(),
        }
    }
}

prop_compose! {
    fn sample()(n in 3usize..20)(
        vertices in prop::collection::vec(any::<[i8; 8]>(), n),
        first in prop::collection::vec(0..n as u8, 3..7),
        faces in prop::collection::vec(prop::collection::vec(0..n as u8, 0..7), 0..8),
        order in Just((0..9).collect::<Vec<usize>>()).prop_shuffle(),
        types in prop::collection::vec(0usize..6, 9),
        normals in any::<bool>(), uvs in any::<bool>(), uv_names in 0usize..4,
        count_type in 0usize..4, index_type in 0usize..4, clutter in any::<bool>(),
    ) -> Sample {
        let faces = std::iter::once(first).chain(faces).collect();
        Sample { vertices, faces, order, types, normals, uvs, uv_names, count_type, index_type, clutter }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn round_trip(sample in sample()) {
        for format in [Format::Ascii, Format::Little, Format::Big] {
            let bytes = sample.print(format);
            prop_assert_eq!(ply::read(&bytes), Ok(sample.expected()), "{:?}", format);
        }
    }

    #[test]
    fn cuts_are_noticed(sample in sample(), at in 0.0f64..1.0) {
        // Whatever is cut off before the last face ends, the reader says so (the ascii tail may lose digits unseen).
        for format in [Format::Little, Format::Big] {
            let bytes = sample.print(format);
            let end = ((bytes.len() - 4) as f64 * at) as usize;
            prop_assert!(ply::read(&bytes[..end]).is_err());
        }
    }

    #[test]
    fn noise_never_panics(sample in sample(), noise in prop::collection::vec((any::<u16>(), any::<u8>()), 1..8)) {
        for format in [Format::Ascii, Format::Little] {
            let mut bytes = sample.print(format);
            for (at, value) in &noise {
                let at = *at as usize % bytes.len();
                bytes[at] = *value;
            }
            if let Ok(mesh) = ply::read(&bytes) {
                let n = mesh.positions.len() as u32;
                prop_assert!(mesh.triangles.iter().flatten().all(|&i| i < n));
            }
        }
    }
}

#[test]
fn a_claim_of_billions_allocates_nothing() {
    for header in [
        "element vertex 4294967295\nproperty double x\nproperty double y\nproperty double z",
        "element vertex 18446744073709551615\nproperty float x\nproperty float y\nproperty float z",
        "element junk 4000000000\nproperty list uchar int stuff",
    ] {
        let text = format!("ply\nformat binary_little_endian 1.0\n{header}\nend_header\n01234567");
        let e = ply::read(text.as_bytes()).unwrap_err();
        assert!(e.message.contains("the file is too short"), "{e}");
        assert_eq!(e.line, 3);
    }
    // Elements without properties take no bytes, and no time.
    let text = "ply\nformat ascii 1.0\nelement junk 18446744073709551615\nend_header\n";
    assert_eq!(ply::read(text.as_bytes()).unwrap_err().message, "no vertices");
}
