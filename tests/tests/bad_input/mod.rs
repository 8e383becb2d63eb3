//! Table of refusals for bad input: every request field just outside and just inside its range,
//! every kind of broken frame, every request in the wrong state. Each row names the expected
//! refusal with its number, and checks that nothing changed and that the outputs are safe.

mod arm;
mod bench;
mod force;
mod frames;
mod joint;
mod lift;
mod orders;
mod setup;
mod table;
mod timed;
mod wall;

use firmware::link::Code;
use std::collections::BTreeSet;

#[test]
fn every_setup_field_out_of_range_is_refused() {
    table::check_all(&setup::rows());
}

#[test]
fn every_joint_field_out_of_range_is_refused() {
    table::check_all(&joint::rows());
}

#[test]
fn every_force_that_cannot_be_controlled_is_refused() {
    table::check_all(&force::rows());
}

#[test]
fn every_force_at_the_hand_that_cannot_be_made_is_refused() {
    table::check_all(&arm::rows());
}

#[test]
fn every_joint_that_cannot_be_modulated_is_refused() {
    table::check_all(&lift::rows());
}

#[test]
fn every_field_of_a_wall_is_held_to_its_range() {
    table::check_all(&wall::rows());
}

#[test]
fn every_order_that_cannot_be_carried_out_is_refused() {
    table::check_all(&orders::rows());
}

#[test]
fn every_time_that_amplitudes_cannot_have_is_refused() {
    table::check_all(&timed::rows());
}

#[test]
fn every_broken_frame_is_refused() {
    frames::check_all(&frames::rows());
}

/// The tables give each code its rows; this checks that every code has one.
#[test]
fn every_code_has_a_row() {
    let rows = [
        setup::rows(),
        joint::rows(),
        wall::rows(),
        arm::rows(),
        lift::rows(),
        force::rows(),
        orders::rows(),
        timed::rows(),
    ];
    let mut covered: BTreeSet<Code> = rows.iter().flatten().filter_map(|row| row.code()).collect();
    covered.extend(frames::rows().iter().flat_map(|row| row.codes()));
    // A simulated world handles the trigger before the device can refuse it; the device's own tests
    // have that row.
    covered.insert(Code::SimulatorOnly);
    // A simulator has the stages that the session configures; `chip_stages` has these rows.
    covered.extend([Code::StagesUnknown, Code::OtherStage, Code::OppositePhases]);
    // Only a breadboard enters a boot loader; `chip_breadboards` has this row.
    covered.insert(Code::InputsClosed);
    // A simulated load is the same in both phases; the tests of the check for lost phases have that
    // row.
    covered.insert(Code::PhaseLost);
    // These take seconds of stimulation; the device's own tests have these rows.
    covered.extend([Code::TimeOver, Code::DoseReached, Code::TooLargeStep]);
    // The range depends on the start of a window; the device's own tests have that row.
    covered.insert(Code::TimeGoesBack);
    // The same holds for memory that is damaged by a reset.
    covered.insert(Code::AllowanceLost);
    let missing: Vec<_> = Code::ALL
        .into_iter()
        .filter(|code| !covered.contains(code))
        .collect();
    assert!(missing.is_empty(), "no row for {missing:?}");
}

/// A refusal contains the field, the range, the number and advice.
#[test]
fn every_refusal_reads_as_a_sentence() {
    for code in Code::ALL {
        let meaning = host_core::link::meaning(code);
        let advice = host_core::link::advice(code);
        assert!(meaning.len() > 10 && advice.len() > 8, "{code:?}");
    }
}
