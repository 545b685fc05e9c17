//! A field as one block of bytes, for flash: 40 bytes of header, then the cells, lower row first.
//!
//! | offset | field | |
//! | --- | --- | --- |
//! | 0 | `b"BFLF"` | |
//! | 4 | version, unexplored byte | `u8` 1, `u8` |
//! | 6 | width, height | `u16`, `u16` |
//! | 10 | 0 | `u16` |
//! | 12 | resolution; origin x, y, yaw; log-likelihood of byte 1, nats a step, σ | 7 × `f32` |
//! | 40 | cells | width·height × `u8` |
//!
//! All little endian, metres and radians.

use super::{LikelihoodField, Scale};
use crate::{
    geometry::Pose,
    grid::{Grid, GridError, Shape},
};

/// Bytes before the cells.
pub const HEADER: usize = 40;
const MAGIC: [u8; 4] = *b"BFLF";
const VERSION: u8 = 1;

/// The field in `bytes`, which stay where they are.
///
/// Fails where they are no field, of another version, or cut off.
pub fn parse(bytes: &[u8]) -> Result<LikelihoodField<&[u8]>, GridError> {
    let passed = bytes.len();
    let Some((header, cells)) = bytes.split_first_chunk::<HEADER>() else {
        return Err(GridError::Storage {
            needed: HEADER,
            passed,
        });
    };
    let [
        m0,
        m1,
        m2,
        m3,
        version,
        unexplored,
        w0,
        w1,
        h0,
        h1,
        _,
        _,
        numbers @ ..,
    ] = header;
    if [*m0, *m1, *m2, *m3] != MAGIC || *version != VERSION {
        return Err(GridError::Format);
    }
    let mut floats = numbers.chunks_exact(4).map(|word| match word {
        [a, b, c, d] => f32::from_le_bytes([*a, *b, *c, *d]),
        _ => 0.0,
    });
    let mut next = || floats.next().unwrap_or(0.0);
    let (resolution, x, y, theta) = (next(), next(), next(), next());
    let (floor, step, sigma) = (next(), next(), next());
    let readable = step > 0.0
        && step < 1.0
        && (0.005..=1.0).contains(&sigma)
        && floor.is_finite()
        && *unexplored >= 2;
    if !readable {
        return Err(GridError::Format);
    }
    let side = |low: u8, high: u8| u32::from(u16::from_le_bytes([low, high]));
    let shape = Shape::new(
        side(*w0, *w1),
        side(*h0, *h1),
        resolution,
        Pose { x, y, theta },
    )?;
    let scale = Scale {
        floor,
        step,
        unexplored: *unexplored,
        sigma,
    };
    LikelihoodField::new(Grid::new(shape, cells)?, scale)
}

/// The header for a field's cells.
#[must_use]
pub fn header(field: &LikelihoodField<&[u8]>) -> [u8; HEADER] {
    let (shape, scale) = (field.grid().shape(), &field.scale);
    let origin = shape.origin();
    let mut header = [0; HEADER];
    let words = [
        shape.resolution(),
        origin.x,
        origin.y,
        origin.theta,
        scale.floor,
        scale.step,
        scale.sigma,
    ];
    let bytes = MAGIC
        .into_iter()
        .chain([VERSION, scale.unexplored])
        .chain(shape.width().to_le_bytes())
        .chain(shape.height().to_le_bytes())
        .chain([0, 0])
        .chain(words.into_iter().flat_map(f32::to_le_bytes));
    for (to, byte) in header.iter_mut().zip(bytes) {
        *to = byte;
    }
    header
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sensor_model::likelihood_field::FieldModel;

    #[test]
    fn what_is_written_is_read_and_what_is_damaged_is_not() {
        let shape = Shape::new(3, 2, 0.05, Pose::new(1.0, -2.0, 0.5)).expect("good");
        let grid = Grid::new(shape, [9u8, 8, 7, 6, 5, 255]).expect("fits");
        let field = LikelihoodField::new(grid, FieldModel::DEFAULT.scale()).expect("small");
        let mut bytes = [0u8; HEADER + 6];
        bytes[..HEADER].copy_from_slice(&header(&field.as_slice()));
        bytes[HEADER..].copy_from_slice(field.grid().cells());
        let back = parse(&bytes).expect("a field");
        assert_eq!(
            (back.grid().shape(), back.grid().cells(), back.scale),
            (&shape, field.grid().cells(), field.scale)
        );
        let damaged = |at: usize, byte: u8| {
            let mut bytes = bytes;
            bytes[at] = byte;
            parse(&bytes).map(|_| ())
        };
        assert_eq!(damaged(0, b'X'), Err(GridError::Format));
        assert_eq!(damaged(4, 2), Err(GridError::Format));
        assert_eq!(
            damaged(6, 4),
            Err(GridError::Storage {
                needed: 8,
                passed: 6
            })
        );
        assert_eq!(
            damaged(6, 0),
            Err(GridError::Size {
                width: 0,
                height: 2
            })
        );
        assert_eq!(damaged(19, 0x7f), Err(GridError::Origin));
        assert_eq!(
            parse(&bytes[..20]).map(|_| ()),
            Err(GridError::Storage {
                needed: HEADER,
                passed: 20
            })
        );
        assert!(parse(&bytes[..HEADER + 5]).is_err());
    }
}
