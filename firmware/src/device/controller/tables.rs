//! The tables of the muscles, which are solved one row at a time after arming, and checked one row at
//! a time from then on.

use crate::device::part::Muscle;
use crate::muscle::{MOST_ROWS, MuscleModelState, TabulatedForce};
use crate::pulse::CHANNELS;

/// Tables of the muscles of a setup, in the order of these.
///
/// Solving a table takes longer than the session may be away, and passing it on would take the memory
/// of a second one. A row takes 2 % of a tick, all tables of a setup together at most 0.64 s. Until its
/// table is complete, a muscle is integrated. All bits of [`Self::NONE`] are zero.
#[derive(Clone, Debug)]
pub struct MuscleTables {
    tables: [TabulatedForce; CHANNELS],
    /// Number of muscles whose table is complete, or which have none.
    complete: usize,
    /// Row that is checked next, counted through all tables.
    checked: usize,
}

impl MuscleTables {
    /// No tables.
    pub const NONE: Self = Self {
        tables: [TabulatedForce::NONE; CHANNELS],
        complete: 0,
        checked: 0,
    };

    /// Returns all tables. A muscle uses its own once it has adopted it.
    pub(super) const fn all(&self) -> &[TabulatedForce; CHANNELS] {
        &self.tables
    }

    /// Resets all tables in place.
    pub fn clear(&mut self) {
        for table in &mut self.tables {
            *table = TabulatedForce::NONE;
        }
        (self.complete, self.checked) = (0, 0);
    }

    /// Begins the tables of other muscles, and empties those of none.
    pub(super) fn begin(&mut self, muscles: &[Muscle]) {
        let mut plans = muscles.iter().map(|muscle| muscle.force.plan());
        for table in &mut self.tables {
            table.begin(plans.next().flatten()); // an earlier setup may have had more
        }
        self.complete = 0;
    }

    /// Solves one row of the first table that is not complete.
    pub(super) fn solve_row(&mut self, muscles: &[Muscle], states: &mut [MuscleModelState]) {
        let mut muscles = muscles.iter().zip(states).zip(&mut self.tables);
        let Some(((muscle, state), table)) = muscles.nth(self.complete) else {
            return;
        };
        if muscle.force.plan().is_none() {
            self.complete += 1; // at most 10
        } else if table.solve_next() {
            muscle.force.adopt(table, state);
            self.complete += 1; // same
        }
    }

    /// Checks one row of one table, and all rows within 640 calls. Returns whether memory has kept
    /// it; the force that another row predicts would be wrong.
    pub(super) fn is_row_intact(&mut self) -> bool {
        let (table, row) = (self.checked / MOST_ROWS, self.checked % MOST_ROWS);
        self.checked = (self.checked + 1) % (CHANNELS * MOST_ROWS); // below 640
        let table = self.tables.get(table);
        table.is_none_or(|table| table.is_row_intact(row))
    }
}

#[cfg(test)]
mod tests {
    use super::super::Controller;
    use super::*;
    use crate::device::Mailboxes;
    use crate::device::mail::ControlOrder;
    use crate::device::part::{ControlPart, Muscle};
    use crate::muscle::MuscleLevel;
    use crate::muscle::{CalciumForceSpec, MuscleModel, Recruitment, RecruitmentSpec, TablePlan};
    use crate::safety::Fault;
    use crate::units::us;
    use crate::units::{Amplitude, Micros};
    use std::boxed::Box;

    /// A muscle's table is complete after as many ticks as it has rows. A row that memory changes
    /// afterwards is a fault within 640 ticks.
    #[test]
    fn a_changed_row_of_a_table_is_a_fault() {
        let spec = CalciumForceSpec {
            a_mn_per_s: 121_900,
            k_micro: 300_000,
            tau_c_us: 20_800,
            tau1_us: 33_100,
            tau2_us: 194_400,
        };
        let recruitment = RecruitmentSpec {
            motor_threshold: Amplitude::new(6_000),
            limit: Amplitude::new(20_000),
            reference: Amplitude::new(20_000),
            slope_micro: 250_000,
        };
        let mut controller = Controller::new();
        let mut mail = Mailboxes::new();
        let (mut pulser, mut mail, _) = mail.split();
        let muscle = Muscle {
            channel: 2,
            recruitment: Recruitment::new(recruitment).unwrap(),
            force: MuscleModel::new(spec, None, MuscleLevel::CalciumForce).unwrap(),
        };
        controller.setup.insert(ControlPart::Muscle(muscle, None));
        let mut tables = Box::new(MuscleTables::NONE);
        controller.reset_to_rest(Micros::new(0), &mut tables);
        let mut now = Micros::new(0);
        let mut tick = |controller: &mut Controller, tables: &mut MuscleTables| {
            now += us(1_000);
            controller.tick(now, None, tables, &mut mail);
        };
        for _ in 0..100 {
            tick(&mut controller, &mut tables);
        }
        assert_eq!(tables.complete, 1);
        assert!(TablePlan::new(&spec).unwrap().is_some());
        assert!(pulser.control_orders.dequeue().is_none());
        tables.tables[0].corrupt_row(7);
        for _ in 0..CHANNELS * MOST_ROWS {
            tick(&mut controller, &mut tables);
        }
        let order = pulser.control_orders.dequeue();
        assert!(
            matches!(order, Some(ControlOrder::Fault(Fault::Ram))),
            "{order:?}"
        );
    }
}
