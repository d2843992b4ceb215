//! Plain little-endian bytes of the structures that a stored zonal solution holds.
//!
//! Whatever bytes are read, reading ends with a value or an error and takes no more memory than a few times the bytes.
//! Indices are checked by the structures themselves ([`super::records::Records::is_sound`], [`super::field::Field::is_sound`]).

use super::file::ZoneFileError;
use hemilux_scene::geom::{Frame, Vec3};

/// What can be put into bytes and taken back.
pub(super) trait Wire: Sized {
    fn put(&self, out: &mut Vec<u8>);
    fn take(at: &mut &[u8]) -> Result<Self, ZoneFileError>;
}

macro_rules! numbers {
    ($($t:ty),*) => {$(
        impl Wire for $t {
            fn put(&self, out: &mut Vec<u8>) {
                out.extend_from_slice(&self.to_le_bytes());
            }

            fn take(at: &mut &[u8]) -> Result<Self, ZoneFileError> {
                let (head, rest) = at.split_first_chunk().ok_or(ZoneFileError::Damaged("it ends too early"))?;
                *at = rest;
                Ok(<$t>::from_le_bytes(*head))
            }
        }
    )*};
}
numbers!(u8, u32, u64, f32, f64);

impl Wire for bool {
    fn put(&self, out: &mut Vec<u8>) {
        (*self as u8).put(out);
    }

    fn take(at: &mut &[u8]) -> Result<Self, ZoneFileError> {
        Ok(u8::take(at)? != 0)
    }
}

impl Wire for Vec3 {
    fn put(&self, out: &mut Vec<u8>) {
        self.to_array().put(out);
    }

    fn take(at: &mut &[u8]) -> Result<Self, ZoneFileError> {
        Ok(Vec3::from_array(Wire::take(at)?))
    }
}

impl<A: Wire, B: Wire> Wire for (A, B) {
    fn put(&self, out: &mut Vec<u8>) {
        self.0.put(out);
        self.1.put(out);
    }

    fn take(at: &mut &[u8]) -> Result<Self, ZoneFileError> {
        Ok((A::take(at)?, B::take(at)?))
    }
}

impl<T: Wire, const N: usize> Wire for [T; N] {
    fn put(&self, out: &mut Vec<u8>) {
        self.iter().for_each(|v| v.put(out));
    }

    fn take(at: &mut &[u8]) -> Result<Self, ZoneFileError> {
        let all = (0..N).map(|_| T::take(at)).collect::<Result<Vec<T>, _>>()?;
        all.try_into().map_err(|_| ZoneFileError::Damaged("it ends too early"))
    }
}

impl<T: Wire> Wire for Option<T> {
    fn put(&self, out: &mut Vec<u8>) {
        (self.is_some() as u8).put(out);
        if let Some(v) = self {
            v.put(out);
        }
    }

    fn take(at: &mut &[u8]) -> Result<Self, ZoneFileError> {
        match u8::take(at)? {
            0 => Ok(None),
            _ => Ok(Some(T::take(at)?)),
        }
    }
}

impl<T: Wire> Wire for Vec<T> {
    fn put(&self, out: &mut Vec<u8>) {
        (self.len() as u64).put(out);
        self.iter().for_each(|v| v.put(out));
    }

    fn take(at: &mut &[u8]) -> Result<Self, ZoneFileError> {
        // Every element takes a byte at least: a longer list is a lie.
        let n = u64::take(at)?;
        if n > at.len() as u64 {
            return Err(ZoneFileError::Damaged("it ends too early"));
        }
        (0..n).map(|_| T::take(at)).collect()
    }
}

/// [`Wire`] for a struct, field by field.
macro_rules! wire {
    ($name:ident { $($field:ident),* }) => {
        impl crate::zones::wire::Wire for $name {
            fn put(&self, out: &mut Vec<u8>) {
                $(self.$field.put(out);)*
            }

            fn take(at: &mut &[u8]) -> Result<Self, crate::zones::file::ZoneFileError> {
                Ok($name { $($field: crate::zones::wire::Wire::take(at)?),* })
            }
        }
    };
}
pub(super) use wire;

wire!(Frame { s, t, n });

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_put_is_taken_and_lies_are_refused() {
        let value: Vec<(u32, Option<[f32; 2]>)> = vec![(7, None), (8, Some([1.0, -2.5]))];
        let mut bytes = Vec::new();
        value.put(&mut bytes);
        let back: Vec<(u32, Option<[f32; 2]>)> = Wire::take(&mut bytes.as_slice()).unwrap();
        assert_eq!(back, value);
        for n in 0..bytes.len() {
            assert!(Vec::<(u32, Option<[f32; 2]>)>::take(&mut &bytes[..n]).is_err(), "{n} bytes");
        }
        let mut long = Vec::new();
        u64::MAX.put(&mut long);
        assert!(Vec::<u32>::take(&mut long.as_slice()).is_err());
    }
}
