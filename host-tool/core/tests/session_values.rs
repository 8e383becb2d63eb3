//! The parsed values of a valid session file, number by number.

use crate::session_errors::{GOOD, spoil};
use firmware::link::Request;
use firmware::muscle::{CalciumForceSpec, FatigueSpec, MuscleLevel};
use firmware::units::Amplitude;
use host_core::session::{Model, Session};

#[test]
fn physical_values_convert_exactly() {
    let session = Session::parse("good.toml", GOOD).unwrap();
    assert_eq!(session.setup_requests().len(), 2 + 4 + 1 + 1 + 1 + 1);
    assert_eq!(session.wearer.max_current_ua, 20_000);
    assert_eq!(session.wearer.max_charge_nc, 5_000);
    let muscle = session.channels[0].muscle.clone().unwrap();
    let (force, recruitment) = (muscle.force, muscle.recruitment);
    let expected = CalciumForceSpec {
        a_mn_per_s: 265_100,
        k_micro: 200_000,
        tau_c_us: 20_000,
        tau1_us: 50_500,
        tau2_us: 100_000,
    };
    assert_eq!(force, expected);
    assert_eq!(recruitment.limit, Amplitude::new(28_000));
    assert_eq!(recruitment.slope_micro, 300_000);
    assert_eq!(session.channels[2].spec.train.period_us, 25_000);
    assert_eq!(session.channels[2].index(), 2);
}

#[test]
fn a_muscle_names_its_rungs() {
    let muscle = |edit: &str| {
        let session = Session::parse("rungs.toml", &spoil(GOOD, edit)).unwrap();
        (session.channels[0].muscle.clone().unwrap(), session)
    };
    let (plain, _) = muscle("k = 0.2 → k = 0.2");
    assert_eq!((plain.model, plain.fatigue), (Model::Auto, None));
    for (name, level) in [
        ("none", MuscleLevel::None),
        ("calcium-force", MuscleLevel::CalciumForce),
        ("calcium-force-fatigue", MuscleLevel::CalciumForceFatigue),
    ] {
        let edit = format!("k = 0.2 → k = 0.2 ⏎ fatigue = {{}} ⏎ model = \"{name}\"");
        let (muscle, session) = muscle(&edit);
        assert_eq!(
            (muscle.model, muscle.initial_level()),
            (Model::Fixed(level), level)
        );
        assert_eq!(muscle.fatigue, Some(FatigueSpec::scaled_to(265_100)));
        let spec = muscle.spec();
        assert!(
            session
                .setup_requests()
                .contains(&Request::Muscle { channel: 0, spec })
        );
    }
    let (muscle, session) = muscle(
        "k = 0.2 → k = 0.2 ⏎ fatigue = { tau_fat_s = 90.5, alpha_a_per_s2 = 0.35 } ⏎ \
         changes = [{ at_s = 2, model = \"calcium-force\" }, { at_s = 4.5, model = \"none\" }]",
    );
    let expected = FatigueSpec {
        alpha_a_milli_per_s2: 350,
        tau_fat_ms: 90_500,
        ..FatigueSpec::scaled_to(265_100)
    };
    assert_eq!(muscle.fatigue, Some(expected));
    let due = |from, to| session.level_changes(from, to).collect::<Vec<_>>();
    let level = |level| Request::MuscleLevel { channel: 0, level };
    assert_eq!(due(0, 1_999_999), []);
    assert_eq!(
        due(1_999_999, 2_000_000),
        [level(MuscleLevel::CalciumForce)]
    );
    assert_eq!(due(2_000_000, 10_000_000), [level(MuscleLevel::None)]);
}

#[test]
fn a_rounded_frequency_is_said() {
    let text = spoil(
        GOOD,
        "frequency_hz = 40, repeats → frequency_hz = 30, repeats",
    );
    let session = Session::parse("rounded.toml", &text).unwrap();
    assert_eq!(session.channels[3].spec.train.period_us, 33_333);
    let note = "channel 4: 30 Hz is rounded to a period of 33333 µs, 30.0003 Hz";
    assert_eq!(session.notes[0], note);
}
