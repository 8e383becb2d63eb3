//! The table of requests: the answer to each, and the check that a refusal changes nothing.

use crate::bad_input::bench::{Bench, LIMIT};
use firmware::link::{Code, Request};
use firmware::safety::State;
use firmware::units::Amplitude;
use host_core::link::{Error, RefusalInWords};

/// Request in a state, with the expected answer.
pub struct Row {
    pub name: String,
    pub scene: fn() -> Bench,
    pub request: Box<dyn Fn(&mut Bench) -> Request>,
    pub expect: Expect,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Expect {
    Done,
    Refused {
        code: Code,
        field: &'static str,
        /// Channel number, counted from 1.
        channel: Option<u8>,
        allowed: Option<(i32, i32)>,
    },
}

impl Row {
    pub fn code(&self) -> Option<Code> {
        match self.expect {
            Expect::Done => None,
            Expect::Refused { code, .. } => Some(code),
        }
    }
}

pub fn refused(code: Code, field: &'static str) -> Expect {
    Expect::Refused {
        code,
        field,
        channel: None,
        allowed: None,
    }
}

impl Expect {
    pub fn on(mut self, number: u8) -> Self {
        if let Self::Refused { channel, .. } = &mut self {
            *channel = Some(number);
        }
        self
    }

    pub fn allowed(mut self, min: i32, max: i32) -> Self {
        if let Self::Refused { allowed, .. } = &mut self {
            *allowed = Some((min, max));
        }
        self
    }
}

/// Creates a row whose request does not depend on the device.
pub fn row(name: &str, scene: fn() -> Bench, request: Request, expect: Expect) -> Row {
    dynamic_row(name, scene, move |_| request.clone(), expect)
}

/// Creates a row whose request depends on the device's state.
pub fn dynamic_row(
    name: &str,
    scene: fn() -> Bench,
    request: impl Fn(&mut Bench) -> Request + 'static,
    expect: Expect,
) -> Row {
    Row {
        name: name.to_owned(),
        scene,
        request: Box::new(request),
        expect,
    }
}

/// Field of a request, with its range.
pub struct Field {
    scene: fn() -> Bench,
    name: &'static str,
    min: i32,
    max: i32,
    channel: Option<u8>,
}

/// Creates a field with the range `min` to `max` in the state that `scene` sets up.
pub fn field(scene: fn() -> Bench, name: &'static str, min: i32, max: i32) -> Field {
    let channel = None;
    Field {
        scene,
        name,
        min,
        max,
        channel,
    }
}
impl Field {
    /// Adds the channel number, from 1, that the refusal must name.
    pub fn on(self, number: u8) -> Self {
        Self {
            channel: Some(number),
            ..self
        }
    }

    /// Returns [`Field::rows`] for a specification that the device accepts, modified by `edit`.
    pub fn edits<S>(
        &self,
        base: impl Fn() -> S,
        edit: Edit<S>,
        request: fn(S) -> Request,
    ) -> Vec<Row> {
        self.rows(|v| {
            let mut spec = base();
            edit(&mut spec, v)?;
            Some(request(spec))
        })
    }

    /// Returns rows for the range's ends, which are accepted, and the values beyond them, which are
    /// not. `make` returns `None` for values that the field's type cannot hold.
    pub fn rows(&self, make: impl Fn(i64) -> Option<Request>) -> Vec<Row> {
        let (min, max) = (i64::from(self.min), i64::from(self.max));
        let far = [i64::from(i32::MIN), i64::from(u16::MAX), u32::MAX.into()];
        let beyond = far.into_iter().filter(|v| !(min..=max).contains(v));
        let out = Expect::Refused {
            code: Code::OutOfRange,
            field: self.name,
            channel: self.channel,
            allowed: Some((self.min, self.max)),
        };
        let inside = [min, max].map(|v| (v, Expect::Done)).into_iter();
        let outside = [min - 1, max + 1].into_iter().chain(beyond);
        inside
            .chain(outside.map(|v| (v, out.clone())))
            .filter_map(|(value, expect)| {
                let name = format!("{} = {value}", self.name);
                Some(row(&name, self.scene, make(value)?, expect))
            })
            .collect()
    }
}

/// Function that sets a number in a specification, if the field's type can hold it.
pub type Edit<S> = fn(&mut S, i64) -> Option<()>;

/// Creates an [`Edit`] that sets a number in a specification, if the field's type can hold it.
macro_rules! edit {
    ($spec:ident, $v:ident => $edit:expr) => {
        |$spec, $v| {
            $edit;
            Some(())
        }
    };
}
pub(super) use edit;

/// Joins the rows of several parts into one list.
pub fn all<const N: usize>(parts: [Vec<Row>; N]) -> Vec<Row> {
    parts.into_iter().flatten().collect()
}

pub fn check_all(rows: &[Row]) {
    let wrong: Vec<_> = rows.iter().filter_map(|row| check(row).err()).collect();
    println!("{} of {} rows are wrong", wrong.len(), rows.len());
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

fn check(row: &Row) -> Result<(), String> {
    let mut bench = (row.scene)();
    let request = (row.request)(&mut bench);
    let is_arm = matches!(request, Request::Arm { .. });
    let before = bench.client.status().map_err(|e| e.to_string())?;
    let codes = bench.codes();
    let got = match bench.ask(request.clone()) {
        Ok(_) => Expect::Done,
        Err(Error::Refused(refused)) => {
            check_help(&refused).map_err(|e| format!("{}: {e}", row.name))?;
            compare_refusal(&refused, &row.expect)?
        }
        Err(other) => return Err(format!("{}: {other}", row.name)),
    };
    if got != row.expect {
        return Err(format!("{}: {got:?}, not {:?}", row.name, row.expect));
    }
    if row.expect == Expect::Done {
        return Ok(());
    }
    let after = bench.client.status().map_err(|e| e.to_string())?;
    let wrong = |reason: &str| Err(format!("{}: {reason}", row.name));
    if after.state != before.state || after.fault != before.fault {
        return wrong(&format!("{:?} became {:?}", before.state, after.state));
    }
    if after.counters.refused != before.counters.refused + 1 {
        return wrong("the refusal was not counted");
    }
    if is_arm {
        // The first attempt blocks nothing: the second is refused for the same reason.
        match bench.ask(request) {
            Err(Error::Refused(again)) if again.code() == row.code() => {}
            other => return wrong(&format!("a second try got {other:?}")),
        }
    }
    if after.state == State::Stimulating {
        bench.wait(50_000);
        if bench.codes() != codes {
            return wrong("amplitudes changed");
        }
    } else if !bench.is_isolated() || (!is_arm && after.counters.pulses != before.counters.pulses) {
        return wrong("outputs are not isolated");
    }
    if after.state == State::Idle && !is_arm && bench.client.arm().is_ok() {
        return check_draft_unchanged(&mut bench).map_err(|e| format!("{}: {e}", row.name));
    }
    Ok(())
}

/// Checks that the limits after arming are those configured before the refusal.
fn check_draft_unchanged(bench: &mut Bench) -> Result<(), String> {
    let taken = bench.client.set_amplitudes(&[(2, LIMIT)]);
    taken.map_err(|e| e.to_string())?;
    match bench
        .client
        .set_amplitudes(&[(2, Amplitude::new(LIMIT.get() + 1))])
    {
        Err(Error::Refused(r)) if r.code() == Some(Code::AboveWearerLimit) => Ok(()),
        other => Err(format!("the draft changed: {other:?}")),
    }
}

fn compare_refusal(refused: &RefusalInWords, expected: &Expect) -> Result<Expect, String> {
    let field = match expected {
        Expect::Refused { field, .. } if *field == refused.field => field,
        _ => return Err(format!("{refused}, where {expected:?} was expected")),
    };
    Ok(Expect::Refused {
        code: refused.code().ok_or("a number nobody knows")?,
        field,
        channel: refused.channel,
        allowed: refused.allowed,
    })
}

/// Checks that number, field, range and advice appear in the text for people.
fn check_help(refused: &RefusalInWords) -> Result<(), String> {
    let text = refused.to_string();
    let code = refused.code().ok_or("a number nobody knows")?;
    let range = refused
        .allowed
        .map_or(String::new(), |(_, max)| max.to_string());
    let number = format!("E{}", refused.number);
    let advice = host_core::link::advice(code);
    for part in [&number, &refused.field, &range, advice] {
        if !text.contains(part) {
            return Err(format!("`{text}` does not say `{part}`"));
        }
    }
    Ok(())
}
