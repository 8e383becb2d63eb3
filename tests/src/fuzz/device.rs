//! A whole device for about a second, judged by the effect of its stages at the electrode.

use super::judged::since_boot;
use super::session::Session;
use super::{Budget, read_steps};
use firmware::link::Request;
use firmware::pulse::CHANNELS;
use firmware::safety::{Origin, StageSupply, StageTable};
use hal_sim::trace::judge::{Pump, judge};

/// Runs the steps of [`super::lockstep`] for up to a second, then a silent host. The output is
/// judged against the armed limits, and must end once the silence is too long.
///
/// The board has the stages that the input's first configuration of each channel names, and loads
/// of 2 kΩ.
pub fn device(data: &[u8]) {
    let steps = read_steps(data, Budget::LONG);
    let requests = steps.iter().filter_map(|step| step.request());
    let stages = declared_stages(requests);
    let mut session = Session::with_stages(stages);
    for step in &steps {
        step.run(&mut session);
    }
    session.set_inputs(0);
    session.advance(1_500_000);
    let end_us = since_boot(session.now());
    let (judged, trace, faults) = session.into_result();
    let truth = judged.truth(&stages, faults);
    let verdict = judge(&trace, &Pump::Throughout, &truth, end_us);
    let findings = &verdict.as_built.findings;
    assert!(findings.is_empty(), "{}", findings[0]);
}

/// Returns the stage in the first valid configuration of each channel.
fn declared_stages(requests: impl Iterator<Item = Request>) -> StageTable {
    let mut table = StageTable {
        origin: Origin::Owner,
        supply: Some(StageSupply::Separate), // the judge considers each stage separately
        stages: [None; CHANNELS],
    };
    for request in requests {
        if let Request::Channel { channel, spec } = request
            && let Some(stage) = table.stages.get_mut(usize::from(channel))
            && stage.is_none()
        {
            *stage = Some(spec.stage.kind());
            if table.validate().is_err() {
                table.stages[usize::from(channel)] = None;
            }
        }
    }
    table
}
