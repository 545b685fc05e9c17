//! The supported sensors: one file or folder a protocol family, each in the same order.
//!
//! 1. Source of the format and layout of its frames, in the file's head.
//! 2. Its models: rows of [`Model`] constants, with what is to be sent to start them (`start`).
//! 3. Constants, commands.
//! 4. `Parser`, with `Parser::for_model(model)`.
//! 5. `judge`: whether bytes begin a frame, and whether it passes its checks.
//! 6. `Packet`: the measurements of a frame.
//! 7. Tests.
//!
//! No family knows another; what several share is in [`super::wire`].

use super::model::Model;

pub mod camsense;
pub mod delta;
pub mod ld06;
pub mod lds006;
pub mod lds01;
pub mod lslidar;
pub mod rplidar;
pub mod scip;
pub mod sick;
pub mod xv11;
pub mod ydlidar;

impl Model {
    /// Every supported model. Of models with the same frames the commonest comes first: bytes alone name that one.
    pub const ALL: &'static [Self] = &[
        Self::LDROBOT_LD06,
        Self::LDROBOT_LD19,
        Self::LDROBOT_STL19P,
        Self::LDROBOT_STL27L,
        Self::LDROBOT_LD14,
        Self::LDROBOT_LD14P,
        Self::LDROBOT_LD14P_2300,
        Self::LDROBOT_LDS02,
        Self::ORADAR_MS200,
        Self::RPLIDAR_SCAN,
        Self::RPLIDAR_EXPRESS,
        Self::RPLIDAR_DENSE,
        Self::RPLIDAR_C1,
        Self::RPLIDAR_C1_SCAN,
        Self::RPLIDAR_ULTRA,
        Self::RPLIDAR_ULTRADENSE,
        Self::RPLIDAR_HQ,
        Self::YDLIDAR_X4,
        Self::YDLIDAR_X2,
        Self::YDLIDAR_G4,
        Self::YDLIDAR_G6,
        Self::YDLIDAR_TG,
        Self::YDLIDAR_TMINI,
        Self::YDLIDAR_G2,
        Self::YDLIDAR_G4B,
        Self::YDLIDAR_S4B,
        Self::COIN_D4,
        Self::YDLIDAR_TMINI_SH,
        Self::HLS_LDS01,
        Self::NEATO_XV11,
        Self::XIAOMI_LDS02RR,
        Self::NEATO_XV11_EARLY,
        Self::LDS006,
        Self::CAMSENSE_X1,
        Self::CAMSENSE_X2,
        Self::CAMSENSE_LDS08RR,
        Self::MYSTERY_360,
        Self::CAMSENSE_T2,
        Self::DELTA_2A,
        Self::DELTA_2G,
        Self::LSLIDAR_N10,
        Self::LSLIDAR_N10P,
        Self::HOKUYO_URG04LX,
        Self::HOKUYO_UTM30LX,
        Self::HOKUYO_UST10LX,
        Self::SICK_LMS200,
    ];

    /// The model of this name.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        Self::ALL.iter().find(|model| model.name == name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lidar::model::Family;

    #[test]
    fn rows_have_names_of_their_own_and_sane_numbers() {
        for (k, model) in Model::ALL.iter().enumerate() {
            let same = Model::ALL.iter().filter(|other| other.name == model.name);
            assert_eq!(same.count(), 1, "{}", model.name);
            assert_eq!(Model::named(model.name), Some(&Model::ALL[k]));
            let per_revolution = model.points_per_s * 10 / u32::from(model.revolutions_per_10s);
            let sees_all_around = !matches!(model.family, Family::Scip(_) | Family::Sick);
            let room = u32::from(model.beams_per_revolution);
            assert!(!sees_all_around || room >= per_revolution, "{}", model.name);
            assert!(model.min_range_mm < model.max_range_mm, "{}", model.name);
        }
    }
}
