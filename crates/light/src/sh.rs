//! Real spherical harmonics, orthonormal, positive constants, index l(l+1)+m, world axes: the order
//! and signs of Ramamoorthi and Hanrahan (2001).

use glam::Vec3;
use serde::{Deserialize, Serialize};

/// Highest band of a spherical-harmonic expansion.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize,
)]
#[serde(try_from = "u8", into = "u8")]
pub enum Order {
    /// 4 coefficients.
    L1,
    /// 9 coefficients, the default.
    #[default]
    L2,
    /// 16 coefficients.
    L3,
    /// 25 coefficients.
    L4,
}

impl Order {
    /// Highest band l, 1 to 4.
    pub const fn band(self) -> usize {
        self as usize + 1
    }

    /// Number of coefficients, (l+1)².
    pub const fn coefficients(self) -> usize {
        (self.band() + 1) * (self.band() + 1)
    }
}

impl TryFrom<u8> for Order {
    type Error = String;

    fn try_from(band: u8) -> Result<Self, String> {
        Ok(match band {
            1 => Self::L1,
            2 => Self::L2,
            3 => Self::L3,
            4 => Self::L4,
            _ => return Err(format!("order {band}: 1 to 4 are known")),
        })
    }
}

impl From<Order> for u8 {
    fn from(order: Order) -> u8 {
        order.band() as u8
    }
}

/// The most coefficients of any [`Order`].
pub const MAX_COEFFICIENTS: usize = 25;

/// The basis functions Y_lm at the unit vector `d`; the first `order.coefficients()` are set.
pub fn basis(order: Order, d: Vec3) -> [f32; MAX_COEFFICIENTS] {
    let Vec3 { x, y, z } = d;
    let mut b = [0.0; MAX_COEFFICIENTS];
    b[0] = 0.282_094_8;
    b[1] = 0.488_602_52 * y;
    b[2] = 0.488_602_52 * z;
    b[3] = 0.488_602_52 * x;
    if order >= Order::L2 {
        b[4] = 1.092_548_4 * x * y;
        b[5] = 1.092_548_4 * y * z;
        b[6] = 0.315_391_57 * (3.0 * z * z - 1.0);
        b[7] = 1.092_548_4 * x * z;
        b[8] = 0.546_274_2 * (x * x - y * y);
    }
    if order >= Order::L3 {
        b[9] = 0.590_043_6 * y * (3.0 * x * x - y * y);
        b[10] = 2.890_611_4 * x * y * z;
        b[11] = 0.457_045_8 * y * (5.0 * z * z - 1.0);
        b[12] = 0.373_176_33 * z * (5.0 * z * z - 3.0);
        b[13] = 0.457_045_8 * x * (5.0 * z * z - 1.0);
        b[14] = 1.445_305_7 * z * (x * x - y * y);
        b[15] = 0.590_043_6 * x * (x * x - 3.0 * y * y);
    }
    if order >= Order::L4 {
        let (x2, y2, z2) = (x * x, y * y, z * z);
        b[16] = 2.503_343 * x * y * (x2 - y2);
        b[17] = 1.770_130_8 * y * z * (3.0 * x2 - y2);
        b[18] = 0.946_174_7 * x * y * (7.0 * z2 - 1.0);
        b[19] = 0.669_046_5 * y * z * (7.0 * z2 - 3.0);
        b[20] = 0.105_785_55 * (35.0 * z2 * z2 - 30.0 * z2 + 3.0);
        b[21] = 0.669_046_5 * x * z * (7.0 * z2 - 3.0);
        b[22] = 0.473_087_35 * (x2 - y2) * (7.0 * z2 - 1.0);
        b[23] = 1.770_130_8 * x * z * (x2 - 3.0 * y2);
        b[24] = 0.625_835_7 * (x2 * (x2 - 3.0 * y2) - y2 * (3.0 * x2 - y2));
    }
    b
}
