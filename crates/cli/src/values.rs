//! Single values as they are given on the command line.

use std::str::FromStr;

use anyhow::{Context, Result, anyhow, ensure};
use glam::Vec3;
use lumencast_light::{Offset, Order};
use lumencast_server::SampleRange;

/// `X,Y,Z`
pub(crate) fn parse_point(text: &str) -> Result<Vec3> {
    let point: [f32; 3] =
        parse_list(text, ',').with_context(|| format!("{text:?}: a point is given as X,Y,Z"))?;
    let point = Vec3::from(point);
    ensure!(point.is_finite(), "{text:?}: coordinates are finite");
    Ok(point)
}

pub(crate) fn parse_list<T: FromStr>(text: &str, separator: char) -> Result<[T; 3]>
where
    T::Err: std::error::Error + Send + Sync + 'static,
{
    let numbers = text.split(separator).map(|n| n.trim().parse()).collect::<Result<Vec<T>, _>>()?;
    numbers.try_into().map_err(|n: Vec<T>| anyhow!("3 numbers are needed, not {}", n.len()))
}

/// How far in front of a surface a field is read.
pub(crate) fn parse_offset(text: &str) -> Result<Offset, String> {
    let number = |text: &str| text.parse().ok().filter(|number: &f32| number.is_finite());
    let offset = match text {
        "none" => Some(Offset::NONE),
        "half-cell" => Some(Offset::HALF_CELL),
        _ => match text.strip_suffix("-cells") {
            Some(cells) => number(cells).map(Offset::Cells),
            None => number(text).map(Offset::Metres),
        },
    };
    offset.ok_or_else(|| "none, half-cell, cells as in 0.2-cells, or a number of metres".into())
}

/// How far ambient occlusion reaches, metres; 0 for none.
pub(crate) fn parse_occlusion(text: &str) -> Result<f32> {
    let metres: f32 = text.parse()?;
    ensure!(metres >= 0.0 && metres.is_finite(), "metres, 0 or more");
    Ok(metres)
}

/// `1` to `4`
pub(crate) fn parse_order(text: &str) -> Result<Order, String> {
    let band: u8 = text.parse().map_err(|e| format!("{e}"))?;
    Order::try_from(band)
}

/// `N` or `MIN..MAX`
pub(crate) fn parse_samples(text: &str) -> Result<SampleRange> {
    let number = |text: &str| -> Result<u32> {
        let n = text.parse().with_context(|| format!("{text:?}: N or MIN..MAX is needed"))?;
        ensure!((1..=1_000_000).contains(&n), "1 to 1000000 samples");
        Ok(n)
    };
    match text.split_once("..") {
        None => Ok(SampleRange::fixed(number(text)?)),
        Some((min, max)) => {
            let (min, max) = (number(min)?, number(max)?);
            ensure!(min <= max, "{min} is more than {max}");
            Ok(SampleRange { min, max })
        }
    }
}

/// A share: more than 0, at most 1.
pub(crate) fn parse_share(text: &str) -> Result<f32> {
    let share: f32 = text.parse()?;
    ensure!(share > 0.0 && share <= 1.0, "more than 0, at most 1");
    Ok(share)
}

/// A number above 0, or `inf`.
pub(crate) fn parse_positive(text: &str) -> Result<f32> {
    let number: f32 = text.parse()?;
    ensure!(number > 0.0, "more than 0");
    Ok(number)
}

/// Ticks a second.
pub(crate) fn parse_rate(text: &str) -> Result<f64> {
    let rate: f64 = text.parse()?;
    ensure!((0.1..=1000.0).contains(&rate), "0.1 to 1000 ticks a second");
    Ok(rate)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_finite() {
        assert_eq!(parse_point("0, -1.5,2").expect("a point"), Vec3::new(0.0, -1.5, 2.0));
        for wrong in ["", "1,2", "1,2,3,4", "1,2,inf"] {
            assert!(parse_point(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn samples() {
        assert_eq!(parse_samples("16").expect("one number"), SampleRange { min: 16, max: 16 });
        assert_eq!(parse_samples("4..64").expect("a range"), SampleRange { min: 4, max: 64 });
        for wrong in ["", "0", "64..4", "..", "-1", "4..x", "99999999"] {
            assert!(parse_samples(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn offsets() {
        assert_eq!(parse_offset("none"), Ok(Offset::NONE));
        assert_eq!(parse_offset("half-cell"), parse_offset("0.5-cells"));
        assert_eq!(parse_offset("0.25"), Ok(Offset::Metres(0.25)));
        for wrong in ["inf", "half", "-cells", "nan-cells", "0.5-metres"] {
            assert!(parse_offset(wrong).is_err(), "{wrong}");
        }
    }
}
