//! Variants of the default controller without one of its terms.

use super::wearer::{self, Points};
use firmware::control::{JointSpec, LawSpec, ResponseSpec};

/// Smallest k2 that the device accepts, in the unit of `k2_milli` of the default controller.
const LEAST_K2_MILLI: u32 = 10;

/// A term of the default controller that an ablation removes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Term {
    /// k1·√|s|; removed by setting k1 to 0.001, the smallest value that the device accepts.
    Root,
    /// The integral of sgn s with the gain k2; removed by setting k2 to 0.01, the smallest value
    /// that the device accepts.
    Sign,
    /// The linear term with the gain k3, beside the root.
    Linear,
    /// The integral of the error with the gain ki.
    IntegralOfError,
    /// Both integrals, so that nothing compensates a constant load.
    Integrals,
    /// The feed-forward, which inverts the model of the nominal wearer; the learning of its scale
    /// is removed with it.
    FeedForward,
    /// The Smith predictor, which compensates the delay.
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

    /// Returns the name of the term in tables.
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

    /// Returns the default controller without this term; everything else is unchanged and not tuned
    /// again.
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
