//! The seed of random tests in `cargo test`: the committed one, or the one that `cargo verify
//! --soak` sets instead.

use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::{RngSeed, TestRunner};

#[test]
fn property_tests_repeat() {
    let config = ProptestConfig::default();
    assert!(
        matches!(config.rng_seed, RngSeed::Fixed(_)),
        ".cargo/config.toml gives no seed, or this is not `cargo test`"
    );
    assert!(config.failure_persistence.is_none(), "files of seeds");
    let draw = || {
        let mut runner = TestRunner::new(ProptestConfig::with_cases(3));
        let strategy = proptest::collection::vec(any::<u64>(), 100);
        strategy.new_tree(&mut runner).unwrap().current()
    };
    assert_eq!(draw(), draw());
}
