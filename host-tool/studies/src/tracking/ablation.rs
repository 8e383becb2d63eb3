//! Variants of the default controller without one of its terms.

use super::wearer::{self, Points};
use firmware::control::{JointSpec, LawSpec, ResponseSpec};

/// Smallest k2 that the device accepts, `K2_MILLI` of the default controller.
const LEAST_K2_MILLI: u32 = 10;

/// A term that can be removed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Term {
    /// k1·√|s|: reduced to the device's minimum, 0.001.
    Root,
    /// The integral of sgn s, k2: reduced to the device's minimum, 0.01.
    Sign,
    /// The linear term beside the root, k3.
    Linear,
    /// The integral of the error, ki.
    IntegralOfError,
    /// Both integrals: then nothing holds a constant load.
    Integrals,
    /// The nominal wearer's inverse, and with it the learning of its scale.
    FeedForward,
    /// The Smith predictor.
    Predictor,
    /// Learning of the feed-forward's scale and damping.
    Learning,
}

impl Term {
    pub const ALL: [Self; 8] = [
        Self::Root,
        Self::Sign,
        Self::Linear,
        Self::IntegralOfError,
        Self::Integrals,
        Self::FeedForward,
        Self::Predictor,
        Self::Learning,
    ];

    /// Returns the name for tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Root => "root k1",
            Self::Sign => "sign integral k2",
            Self::Linear => "linear k3",
            Self::IntegralOfError => "error integral ki",
            Self::Integrals => "both integrals",
            Self::FeedForward => "feed-forward",
            Self::Predictor => "predictor",
            Self::Learning => "learning",
        }
    }

    /// Returns the default controller without the term, otherwise unchanged.
    pub fn without(self, points: Points) -> JointSpec {
        let mut spec = wearer::shipped(points);
        if let LawSpec::Recommended {
            k1_milli,
            k2_milli,
            k3_milli,
            ki_milli,
            ..
        } = &mut spec.law
        {
            match self {
                Self::Root => *k1_milli = 1,
                Self::Sign => *k2_milli = LEAST_K2_MILLI,
                Self::Linear => *k3_milli = 0,
                Self::IntegralOfError => *ki_milli = 0,
                Self::Integrals => (*k2_milli, *ki_milli) = (LEAST_K2_MILLI, 0),
                Self::FeedForward | Self::Predictor | Self::Learning => {}
            }
        }
        if self == Self::FeedForward {
            spec.wearer = None;
        }
        spec.response = spec.response.map(|response| match self {
            Self::Predictor => ResponseSpec {
                gain_mrad: 0,
                ..response
            },
            Self::Learning | Self::FeedForward => ResponseSpec {
                scale_milli: 0,
                damping_milli: 0,
                ..response
            },
            _ => response,
        });
        spec
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use firmware::control::Joint;

    #[test]
    fn the_device_takes_the_default_without_any_term_and_it_is_another() {
        for points in Points::ALL {
            for term in Term::ALL {
                let spec = term.without(points);
                assert!(Joint::new(&spec).is_ok(), "{term:?}");
                assert_ne!(spec, wearer::shipped(points), "{term:?}");
            }
        }
    }
}
