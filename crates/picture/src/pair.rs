//! Two pictures that can be compared.

use crate::{CompareError, Picture};

/// A reference and a picture of the same size, all of whose values are finite.
#[derive(Clone, Copy, Debug)]
pub struct Pair<'a> {
    reference: &'a Picture,
    picture: &'a Picture,
}

impl<'a> Pair<'a> {
    /// # Errors
    /// The sizes differ, or a value is infinite or not a number.
    pub fn new(reference: &'a Picture, picture: &'a Picture) -> Result<Self, CompareError> {
        let size = |p: &Picture| (p.width(), p.height());
        let (of_reference, of_picture) = (size(reference), size(picture));
        if of_reference != of_picture {
            return Err(CompareError::Sizes { reference: of_reference, picture: of_picture });
        }
        refuse_not_finite("the reference", reference)?;
        refuse_not_finite("the picture", picture)?;
        Ok(Self { reference, picture })
    }

    /// What is held to be right.
    pub fn reference(&self) -> &'a Picture {
        self.reference
    }

    /// What is judged.
    pub fn picture(&self) -> &'a Picture {
        self.picture
    }
}

fn refuse_not_finite(which: &'static str, picture: &Picture) -> Result<(), CompareError> {
    let mut bad = (0_u32..).zip(picture.pixels()).filter(|(_, p)| !p.is_finite());
    let Some((first, _)) = bad.next() else { return Ok(()) };
    Err(CompareError::NotFinite {
        which,
        count: 1 + bad.count(),
        x: first % picture.width(),
        y: first / picture.width(),
    })
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn what_cannot_be_compared_is_refused() {
        let good = Picture::from_fn(5, 4, |_, _| Vec3::ONE);
        let other = Picture::from_fn(4, 5, |_, _| Vec3::ONE);
        let said = Pair::new(&good, &other).expect_err("other size").to_string();
        assert!(said.contains("5 × 4") && said.contains("4 × 5"), "{said}");

        let mut bad = good.clone();
        bad.pixels_mut()[13].y = f32::NAN;
        bad.pixels_mut()[19].z = f32::NEG_INFINITY;
        let error = Pair::new(&good, &bad).expect_err("not finite");
        assert!(matches!(error, CompareError::NotFinite { count: 2, x: 3, y: 2, .. }), "{error}");
        assert!(error.to_string().contains("the picture"), "{error}");
        assert!(Pair::new(&bad, &good).expect_err("too").to_string().contains("the reference"));
        assert!(Pair::new(&good, &good).is_ok());
    }
}
