//! Isolated groups: the edges of their members are processed together, in the order of time.

use super::agenda::EventQueue;
use super::lane::Lane;
use super::{RenderError, Supply, bit_positions};
use crate::pulse::CHANNELS;
use crate::pulse::plan::WindowPlan;
use crate::units::Micros;

/// Advances the members of an isolated group through the window, earliest edge first, and
/// determines after each edge which groundings it interrupts or resumes.
pub(super) fn advance_together(
    lanes: &mut [Option<Lane>; CHANNELS],
    members: u16,
    agenda: &mut EventQueue,
    supply: &mut impl Supply,
    plan: &mut WindowPlan,
) -> Result<(), RenderError> {
    while let Some(now) = earliest(next_edge_times(lanes, members))
        && let Some(slot) = agenda.slot(now)
    {
        let mut pulsing = 0;
        for channel in bit_positions(members.into()) {
            if let Some(Some(lane)) = lanes.get_mut(channel) {
                if lane.due == Some(now) {
                    let old = lane.shows;
                    // channel < 10 fits u8.
                    lane.perform_edge(channel as u8, now, supply, plan)?;
                    agenda.insert(slot, old.0 ^ lane.shows.0);
                }
                pulsing |= lane.shows.pulsing();
            }
        }
        for channel in bit_positions(members.into()) {
            if let Some(Some(lane)) = lanes.get_mut(channel) {
                let old = lane.shows;
                lane.update_grounding(now, pulsing != 0);
                agenda.insert(slot, old.0 ^ lane.shows.0);
            }
        }
    }
    Ok(())
}

/// Returns the times of the next edges of the lanes in `members` that have one.
pub(super) fn next_edge_times(
    lanes: &[Option<Lane>; CHANNELS],
    members: u16,
) -> impl Iterator<Item = Micros> {
    let lanes = lanes.iter().enumerate();
    lanes.filter_map(move |(channel, lane)| {
        let due = lane.as_ref()?.due?;
        (members & 1 << channel != 0).then_some(due)
    })
}

/// Returns the earliest of `times`, which lie within half the clock's range.
pub(super) fn earliest(times: impl Iterator<Item = Micros>) -> Option<Micros> {
    times.fold(None, |first, at| earlier(first, Some(at)))
}

/// Returns the earlier of two times, if any.
fn earlier(a: Option<Micros>, b: Option<Micros>) -> Option<Micros> {
    match (a, b) {
        (Some(a), Some(b)) => Some(if b.is_before(a) { b } else { a }),
        _ => a.or(b),
    }
}
