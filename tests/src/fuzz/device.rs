//! A whole device for a second or so, judged by what its stages would do at the electrode.

use super::judged::since_boot;
use super::session::Session;
use super::{Budget, read_steps};
use firmware::link::Request;
use firmware::pulse::CHANNELS;
use firmware::safety::{Origin, StageSupply, StageTable};
use hal_sim::trace::judge::{Pump, judge};

/// The steps of [`super::lockstep`] for up to a second, then a host that is silent: what
/// came out is judged against the limits that were armed, and nothing comes out once the
/// silence was too long.
///
/// The board has the stages that the input's first configuration of each channel declares,
/// and loads of 2 kΩ.
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

/// What the first valid configuration of each channel declares.
fn declared_stages(requests: impl Iterator<Item = Request>) -> StageTable {
    let mut table = StageTable {
        origin: Origin::Owner,
        supply: Some(StageSupply::Separate), // the judge knows each stage by itself
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
