//! Checking settings, at compile time if need be.
//!
//! Each settings struct has a `const fn checked(self) -> Result<Self, ConfigError>`. In a `const`, a setting that is out
//! of its range does not compile: see [`IcpConfig::checked`](crate::matching::icp::IcpConfig::checked).

use core::fmt;

/// Why settings cannot be used.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ConfigError {
    /// A setting is outside its range, or not a number.
    OutOfRange {
        /// Name of the field.
        setting: &'static str,
        /// Its value.
        value: f32,
        /// Smallest value that is allowed.
        min: f32,
        /// Largest value that is allowed.
        max: f32,
    },
    /// Weights that must sum to one do not.
    Sum {
        /// Their sum.
        sum: f32,
    },
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OutOfRange {
                setting,
                value,
                min,
                max,
            } => write!(f, "{setting} is {value}, not within {min} to {max}"),
            Self::Sum { sum } => write!(f, "the weights sum to {sum}, not to 1"),
        }
    }
}

impl core::error::Error for ConfigError {}

/// Refuses a value outside `min..=max`, and NaN.
pub(crate) const fn within(
    setting: &'static str,
    value: f32,
    min: f32,
    max: f32,
) -> Result<(), ConfigError> {
    if value >= min && value <= max {
        Ok(())
    } else {
        Err(ConfigError::OutOfRange {
            setting,
            value,
            min,
            max,
        })
    }
}

/// The first error of several checks.
pub(crate) const fn all(mut checks: &[Result<(), ConfigError>]) -> Result<(), ConfigError> {
    while let [first, rest @ ..] = checks {
        if let Err(error) = first {
            return Err(*error);
        }
        checks = rest;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_value_out_of_range_is_named() {
        assert_eq!(within("a", 1.0, 1.0, 1.0), Ok(()));
        assert!(within("a", f32::NAN, 0.0, 1.0).is_err());
        let checks = [within("a", 0.5, 0.0, 1.0), within("b", 2.0, 0.0, 1.0)];
        assert_eq!(all(&checks[..1]), Ok(()));
        let error = all(&checks).expect_err("b is too large");
        assert_eq!(
            error,
            ConfigError::OutOfRange {
                setting: "b",
                value: 2.0,
                min: 0.0,
                max: 1.0
            }
        );
    }
}
