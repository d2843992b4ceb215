//! The file form of a zonal solution (`.hlxz`): a header, then raw little-endian arrays, then a CRC.
//!
//! Layout: magic `HLXZON10`, scene hash u64, zone budget u32, zone count u32, particles u64, ledger (5 × 3 f64, rays
//! u64), then per zone side: total 3 × f32, caustic 3 × f32, glints 3 × f32, error f32; then the bright zones and what steers gathers
//! (records, field; see [`super::wire`]); last CRC-32 (IEEE) of all before it. The cut
//! itself is not stored: it follows from scene and budget, and reading makes it anew.

use super::field::Field;
use super::particles::Ledger;
use super::records::Records;
use super::wire::Wire;
use super::{ZoneMap, Zones};
use crate::world::World;
use hemilux_scene::Rgb;
use std::io::{self, Write};
use std::sync::Arc;

const MAGIC: &[u8; 8] = b"HLXZON10";

/// Why a file is not the zonal solution that was wanted.
#[derive(Debug, thiserror::Error)]
pub enum ZoneFileError {
    /// Reading or writing failed.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// Not such a file, or another version of it.
    #[error("not a zonal solution of this version (magic HLXZON10 missing)")]
    Magic,
    /// Cut short or altered.
    #[error("the file is damaged: {0}")]
    Damaged(&'static str),
    /// Made from another scene.
    #[error("made from another scene (hash {found:016x}, this scene has {expected:016x})")]
    OtherScene {
        /// In the file.
        found: u64,
        /// Of the scene at hand.
        expected: u64,
    },
}

impl Zones {
    /// Write the solution for `world`, cut with `budget` zones.
    pub fn write(&self, world: &World, budget: u32, out: &mut dyn Write) -> io::Result<()> {
        let mut bytes = Vec::with_capacity(256 + self.total.len() * 40);
        bytes.extend_from_slice(MAGIC);
        bytes.extend_from_slice(&world.scene.content_hash.to_le_bytes());
        bytes.extend_from_slice(&budget.to_le_bytes());
        bytes.extend_from_slice(&(self.map.len() as u32).to_le_bytes());
        bytes.extend_from_slice(&self.particles.to_le_bytes());
        let l = &self.ledger;
        for v in [l.emitted, l.absorbed, l.escaped, l.incident, l.truncated].into_iter().flatten() {
            bytes.extend_from_slice(&v.to_le_bytes());
        }
        bytes.extend_from_slice(&l.rays.to_le_bytes());
        for side in 0..self.total.len() {
            let (t, c, g) = (self.total[side].0, self.caustic[side].0, self.glints[side].0);
            for v in t.into_iter().chain(c).chain(g).chain([self.error[side]]) {
                bytes.extend_from_slice(&v.to_le_bytes());
            }
        }
        self.bright.put(&mut bytes);
        self.records.put(&mut bytes);
        self.field.put(&mut bytes);
        let crc = crc32fast::hash(&bytes);
        bytes.extend_from_slice(&crc.to_le_bytes());
        out.write_all(&bytes)
    }

    /// Read a solution back; it must have been made from the same scene.
    pub fn read(world: &World, bytes: &[u8]) -> Result<Zones, ZoneFileError> {
        if bytes.len() < 12 || &bytes[..8] != MAGIC {
            return Err(ZoneFileError::Magic);
        }
        let (body, crc) = bytes.split_at(bytes.len() - 4);
        if crc32fast::hash(body) != u32::from_le_bytes([crc[0], crc[1], crc[2], crc[3]]) {
            return Err(ZoneFileError::Damaged("its checksum does not match (truncated or altered)"));
        }
        let mut at = Reader { bytes: &body[8..] };
        let found = at.u64()?;
        let expected = world.scene.content_hash;
        if found != expected {
            return Err(ZoneFileError::OtherScene { found, expected });
        }
        let (budget, count, particles) = (at.u32()?, at.u32()?, at.u64()?);
        let mut triples = [[0f64; 3]; 5];
        for v in triples.iter_mut().flatten() {
            *v = f64::from_bits(at.u64()?);
        }
        let [emitted, absorbed, escaped, incident, truncated] = triples;
        let ledger = Ledger { emitted, absorbed, escaped, incident, truncated, rays: at.u64()? };
        let map = ZoneMap::new(world, budget);
        if map.len() as u64 != count as u64 || (at.bytes.len() as u64) < count as u64 * 2 * 40 {
            return Err(ZoneFileError::Damaged("it holds another number of zones than this scene has"));
        }
        let (mut total, mut caustic, mut glints, mut error) =
            (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for _ in 0..count as usize * 2 {
            total.push(Rgb([at.f32()?, at.f32()?, at.f32()?]));
            caustic.push(Rgb([at.f32()?, at.f32()?, at.f32()?]));
            glints.push(Rgb([at.f32()?, at.f32()?, at.f32()?]));
            error.push(at.f32()?);
        }
        let bright: Vec<u32> = Wire::take(&mut at.bytes)?;
        if !bright.is_sorted() {
            return Err(ZoneFileError::Damaged("its bright zones are out of order"));
        }
        let (records, field) = (Records::take(&mut at.bytes)?, Field::take(&mut at.bytes)?);
        if !(at.bytes.is_empty() && records.is_sound() && field.is_sound()) {
            return Err(ZoneFileError::Damaged("what it says of virtual luminaires does not fit together"));
        }
        let (records, field) = (Arc::new(records), Arc::new(field));
        let witnesses = std::sync::OnceLock::new();
        let broad = std::sync::OnceLock::new();
        Ok(Zones {
            map,
            total,
            caustic,
            glints,
            bright,
            error,
            records,
            field,
            witnesses,
            broad,
            ledger,
            particles,
        })
    }
}

struct Reader<'a> {
    bytes: &'a [u8],
}

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], ZoneFileError> {
        let (head, rest) =
            self.bytes.split_first_chunk::<N>().ok_or(ZoneFileError::Damaged("it ends too early"))?;
        self.bytes = rest;
        Ok(*head)
    }

    fn u64(&mut self) -> Result<u64, ZoneFileError> {
        Ok(u64::from_le_bytes(self.take()?))
    }

    fn u32(&mut self) -> Result<u32, ZoneFileError> {
        Ok(u32::from_le_bytes(self.take()?))
    }

    fn f32(&mut self) -> Result<f32, ZoneFileError> {
        Ok(f32::from_le_bytes(self.take()?))
    }
}
