//! Tables that survive encoding and decoding, and damaged ones that are refused.

use super::*;

const UID: [u32; 3] = [1, 2, 3];
const AMPS: StageKind = StageKind::Current {
    full_scale_ua: 100_000,
};
const VOLTS: StageKind = StageKind::Voltage {
    full_scale_mv: 60_000,
};

fn table() -> StageTable {
    let mut stages = [Some(AMPS); CHANNELS];
    (stages[3], stages[9]) = (Some(VOLTS), None);
    StageTable {
        origin: Origin::Owner,
        supply: Some(StageSupply::Common),
        stages,
    }
}

fn stored(words: &StageWords) -> Stages {
    Stages::from_copies([words, words], UID)
}

#[test]
fn a_table_comes_back_from_its_words() {
    for origin in [Origin::Owner, Origin::Session] {
        for supply in [None, Some(StageSupply::Common), Some(StageSupply::Separate)] {
            let table = StageTable {
                origin,
                supply,
                ..table()
            };
            let stages = stored(&table.to_words(UID));
            assert_eq!(stages, Stages::Stored(table));
            assert_eq!(stages.may_oppose(), supply == Some(StageSupply::Separate));
        }
    }
}

/// Decodes a table from a firmware version that had no supply field.
#[test]
fn a_table_from_before_declares_no_supply() {
    let mut words = table().to_words(UID);
    words[1] = 1 << 16 | 1;
    words[WORDS - 1] = checksum(&words[..WORDS - 1]);
    let before = StageTable {
        origin: Origin::Session,
        supply: None,
        ..table()
    };
    assert_eq!(stored(&words), Stages::Stored(before));
    assert!(!stored(&words).may_oppose());
}

#[test]
fn every_flipped_bit_makes_the_stages_unknown() {
    let words = table().to_words(UID);
    for bit in 0..32 * WORDS {
        let mut flipped = words;
        flipped[bit / 32] ^= 1 << (bit % 32);
        let half = Stages::Unknown(StagesFault::Incomplete);
        assert_eq!(
            Stages::from_copies([&flipped, &words], UID),
            half,
            "bit {bit}"
        );
        assert_eq!(
            Stages::from_copies([&words, &flipped], UID),
            half,
            "bit {bit}"
        );
        let damaged = Stages::Unknown(StagesFault::Damaged);
        assert_eq!(stored(&flipped), damaged, "bit {bit}");
    }
}

#[test]
fn what_is_no_table_of_this_board_is_told_apart() {
    let (words, erased) = (table().to_words(UID), [ERASED; WORDS]);
    let unknown = |fault| Stages::Unknown(fault);
    assert_eq!(stored(&erased), unknown(StagesFault::Erased));
    let half = unknown(StagesFault::Incomplete);
    assert_eq!(Stages::from_copies([&words, &erased], UID), half);
    assert_eq!(Stages::from_copies([&erased, &words], UID), half);
    let mut other = table();
    other.stages[0] = Some(VOLTS);
    assert_eq!(
        Stages::from_copies([&words, &other.to_words(UID)], UID),
        half
    );
    assert_eq!(
        Stages::from_copies([&words, &words], [1, 2, 4]),
        unknown(StagesFault::OtherBoard)
    );
    for version in [
        3 << 16 | 1 << 8,
        2 << 16,
        2 << 16 | 3 << 8,
        1 << 16 | 1 << 8,
    ] {
        let mut later = words;
        later[1] = version;
        later[WORDS - 1] = checksum(&later[..WORDS - 1]);
        let found = stored(&later);
        assert_eq!(found, unknown(StagesFault::Version), "{version:#x}");
    }
    // A correct checksum over an impossible stage.
    let mut wild = words;
    wild[HEAD] = 1 << KIND_SHIFT | 999;
    wild[WORDS - 1] = checksum(&wild[..WORDS - 1]);
    assert_eq!(stored(&wild), unknown(StagesFault::Damaged));
}

/// Stores another table over this one as the board does (copy after copy, erased and then word by
/// word), with a power failure at each step and within it: a half erased sector has ones in place
/// of some zeros, a half programmed word lacks some of its zeros.
#[test]
fn power_that_fails_at_any_step_of_a_writing_leaves_no_third_table() {
    let mut other = table();
    other.stages[0] = Some(VOLTS);
    let (old, new) = (table().to_words(UID), other.to_words(UID));
    let mut random = 2_020u32;
    let mut some_ones = || {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        random.rotate_left(16)
    };
    let (mut copies, mut steps) = ([old; 2], 0);
    let mut fails = |copies: [&StageWords; 2]| {
        steps += 1;
        match Stages::from_copies(copies, UID) {
            Stages::Unknown(_) => {}
            Stages::Stored(stage_table) if stage_table == table() => assert_eq!(copies, [&old; 2]),
            Stages::Stored(stage_table) if stage_table == other => assert_eq!(copies, [&new; 2]),
            third => panic!("{third:?} of {copies:x?}"),
        }
    };
    for copy in 0..2 {
        let mut within = |copies: &[StageWords; 2], words: StageWords| {
            let mut copies = *copies;
            copies[copy] = words;
            fails(copies.each_ref());
        };
        for _ in 0..500 {
            let ones = some_ones();
            within(&copies, copies[copy].map(|word| word | ones));
        }
        copies[copy] = [ERASED; WORDS];
        within(&copies, copies[copy]);
        for (at, word) in new.into_iter().enumerate() {
            for _ in 0..100 {
                let mut words = copies[copy];
                words[at] = word | some_ones();
                within(&copies, words);
            }
            copies[copy][at] = word;
            within(&copies, copies[copy]);
        }
    }
    assert_eq!(copies, [new; 2]);
    assert_eq!(steps, 2 * (500 + 1 + 101 * WORDS));
}

#[test]
fn a_false_declaration_is_named() {
    let stages = Stages::Stored(table());
    let amps = |full_scale_ua| StageSpec::Current { full_scale_ua };
    let volts = |full_scale_mv| StageSpec::Voltage {
        full_scale_mv,
        load_ohm: 2_000,
    };
    assert_eq!(stages.check(0, &amps(100_000)), Ok(()));
    assert_eq!(stages.check(3, &volts(60_000)), Ok(()));
    assert_eq!(stages.check(0, &volts(60_000)), Err(StageMismatch::Kind));
    assert_eq!(stages.check(3, &amps(100_000)), Err(StageMismatch::Kind));
    let (field, has) = ("full_scale_ua", 100_000);
    assert_eq!(
        stages.check(0, &amps(50_000)),
        Err(StageMismatch::FullScale { field, has })
    );
    assert_eq!(stages.check(9, &amps(1_000)), Err(StageMismatch::NoStage));
    assert_eq!(Stages::AsConfigured.check(9, &amps(1_000)), Ok(()));
    let unknown = Stages::Unknown(StagesFault::Erased);
    let refused = StageMismatch::Unknown(StagesFault::Erased);
    assert_eq!(unknown.check(0, &amps(100_000)), Err(refused));
    let simulated = Stages::Simulated {
        channels: 0b10_1000_1110,
    };
    let accepted = |stage| [0, 1, 9, 10, 16, 255].map(|n| simulated.check(n, &stage).is_ok());
    let expected = [false, true, true, false, false, false];
    assert_eq!(accepted(amps(50_000)), expected);
    assert_eq!(accepted(volts(60_000)), expected);
}
