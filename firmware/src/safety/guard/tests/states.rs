//! Generates docs/reference/states.md: the actual result of every event in every state.
//!
//! `FLEXOR_OVERWRITE=1 cargo test -p firmware --lib states` renews the page.

use super::*;
use std::string::String;

const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/reference/states.md");
const WITHIN: Stimulus = stimulus(5_000, 0);
const ABOVE: Stimulus = stimulus(20_001, 0); // the channel's limit is 20 mA
const STATES: [&str; 9] = [
    "Boot",
    "Idle",
    "Checking",
    "Armed",
    "Stimulating",
    "Stopping",
    "Stopping at once",
    "Fault",
    "Grounding",
];

/// How the guard reacted: a refusal, a notice, or neither.
#[derive(PartialEq, Debug)]
enum EventResult {
    Nothing,
    Refused(Denial),
    Told(Notice),
}

type EventFunction = fn(&mut Guard, &Scheduler, Micros) -> EventResult;

/// Every call that the pulser makes to a guard, and every input that the guard reads.
const EVENTS: [(&str, EventFunction); 20] = [
    ("`arm`, stop and key closed", |g, _, now| {
        answer(g.arm(&setup(), &CLOSED, now))
    }),
    ("`arm`, nothing closed", |g, _, now| {
        answer(g.arm(&setup(), &OPEN, now))
    }),
    ("`arm` by the key, the stop asked for", |g, _, now| {
        let key = Inputs { arm: true, ..OPEN };
        answer(g.arm(&careful(), &key, now))
    }),
    ("`start`", |g, _, now| answer(g.start(now))),
    ("`stop`", |g, _, now| told(g.stop(now))),
    ("`acknowledge`", |g, _, now| answer(g.acknowledge(now))),
    ("an amplitude within the limit", |g, _, now| {
        answer(g.set_amplitudes([(0, WITHIN)].into_iter(), now))
    }),
    ("an amplitude above the limit", |g, _, now| {
        answer(g.set_amplitudes([(0, ABOVE)].into_iter(), now))
    }),
    ("the law asks for more than the limit", |g, _, now| {
        g.set_control_amplitude(0, ABOVE.amplitude, now);
        EventResult::Nothing
    }),
    ("a keep-alive", |g, _, now| {
        g.keep_alive(now);
        EventResult::Nothing
    }),
    ("the stop opens", |g, s, now| {
        let key = Inputs { arm: true, ..OPEN };
        refill(g, s, now, &key)
    }),
    ("the key opens", |g, s, now| {
        let hand_stop = true;
        refill(g, s, now, &Inputs { hand_stop, ..OPEN })
    }),
    ("both open", |g, s, now| refill(g, s, now, &OPEN)),
    ("nothing new", |g, s, now| refill(g, s, now, &CLOSED)),
    ("its time is up", |g, s, now| {
        refill(g, s, now + us(11_000_000), &CLOSED)
    }),
    ("all trains have played", |g, _, now| {
        refill(g, &Scheduler::new(), now, &CLOSED)
    }),
    ("a comparator latched", |g, s, now| {
        let over_current = true;
        let inputs = Inputs {
            over_current,
            ..CLOSED
        };
        refill(g, s, now, &inputs)
    }),
    ("a reading above the limit", |g, s, now| {
        let reading = Some(Reading::from_current(0, false, MicroAmps::new(30_000)));
        refill(g, s, now, &Inputs { reading, ..CLOSED })
    }),
    ("the state changes by itself", |g, _, now| {
        g.renew_checksums();
        g.heard += us(1 << 20);
        match g.check_memory() {
            Ok(()) => EventResult::Nothing,
            Err(fault) => EventResult::Told(g.fault(&FaultRecord::new(fault, now), [0; CHANNELS])),
        }
    }),
    ("a fault from elsewhere", |g, _, now| {
        EventResult::Told(g.fault(&FaultRecord::new(Fault::MissedDeadline, now), [0; CHANNELS]))
    }),
];

const OPEN: Inputs = Inputs {
    arm: false,
    hand_stop: false,
    ..CLOSED
};

/// Returns a setup whose wearer requires the hand-held stop.
fn careful() -> Setup {
    let spec = WearerSpec {
        hand_stop_required: true,
        ..WearerSpec::default()
    };
    Setup {
        wearer: spec.validate().unwrap(),
        ..setup()
    }
}

fn answer<T>(answer: Result<T, Denial>) -> EventResult {
    answer.map_or_else(EventResult::Refused, |_| EventResult::Nothing)
}

fn told(notice: Option<Notice>) -> EventResult {
    notice.map_or(EventResult::Nothing, EventResult::Told)
}

/// Runs a refill's tick and latches its fault, as the pulser does.
fn refill(guard: &mut Guard, scheduler: &Scheduler, now: Micros, inputs: &Inputs) -> EventResult {
    match guard.tick(now, inputs, scheduler) {
        Ok(notice) => told(notice),
        Err(fault) => EventResult::Told(guard.fault(&FaultRecord::new(fault, now), [0; CHANNELS])),
    }
}

/// Returns [`guard_in`] with a channel whose wanted amplitude is 5 mA, and its scheduler.
fn wanting(state: &str) -> (Guard, Scheduler) {
    let (mut guard, scheduler) = match state {
        "Stopping" | "Stopping at once" => guard_in("Stimulating"),
        _ => guard_in(state),
    };
    if guard.state() == State::Armed || guard.state() == State::Stimulating {
        let order = [(0, WITHIN)].into_iter();
        guard.set_amplitudes(order, NOW).unwrap();
    }
    match state {
        "Stopping" => {
            guard.stop(NOW).unwrap();
        }
        "Stopping at once" => {
            let notice = guard.tick(NOW, &OPEN, &scheduler).unwrap();
            assert_eq!(notice, Some(Notice::Stopping(StopCause::HandStop)));
        }
        _ => {}
    }
    (guard, scheduler)
}

/// Returns the time at which an event happens in `state`: after the events that led there, and
/// before the state ends by itself.
fn then(state: &str) -> Micros {
    let check_us = ElectrodeCheck::length_us();
    match state {
        "Checking" => NOW + us(check_us - 2 * WINDOW_US),
        _ => NOW + us(check_us + WINDOW_US),
    }
}

/// Returns the state in the page's words.
fn place(guard: &Guard) -> &'static str {
    match guard.mode {
        Mode::Stopping { cause, .. } if is_immediate(cause) => "Stopping at once",
        _ => name(guard),
    }
}

/// Returns whether a burst that would begin a window after `now` is output.
fn pulses(guard: &mut Guard, now: Micros) -> bool {
    let at = now + us(WINDOW_US);
    guard.burst(0, begins(at)).code.is_some() && guard.may_pulse(0, at + us(500))
}

fn in_words(heard: &EventResult) -> String {
    let text = match heard {
        EventResult::Nothing => return "–".into(),
        EventResult::Refused(denied) => format!("refused: {denied:?}"),
        EventResult::Told(Notice::Faulted(record)) => {
            let (number, fault) = (record.fault.number(), record.fault);
            match record.later_faults {
                0 => format!("fault {number}, {fault:?}"),
                later => format!("fault {number}, {fault:?}, and later {}", later.ilog2() + 1),
            }
        }
        EventResult::Told(Notice::Checked(Err(denied))) => format!("not armed: {denied:?}"),
        EventResult::Told(notice) => format!("{notice:?}"),
    };
    // Only the name of a structure, without its fields.
    text.split(" {").next().unwrap_or_default().into()
}

fn page() -> String {
    let mut page = String::from(HEAD);
    for state in STATES {
        let (mut guard, _) = wanting(state);
        assert_eq!(place(&guard), state);
        let pump = if guard.is_pump_on() { "on" } else { "off" };
        let puts_out = if pulses(&mut guard, NOW) {
            "a pulse may begin"
        } else {
            "no pulse begins"
        };
        page += &format!("\n## {state}\n\nPump {pump}; {puts_out}.\n\n");
        page += "| what happens | then | it says |\n|---|---|---|\n";
        for (event, happens) in EVENTS {
            let (mut guard, scheduler) = wanting(state);
            let heard = happens(&mut guard, &scheduler, then(state));
            let after = place(&guard);
            let after = if after == state { "–" } else { after };
            page += &format!("| {event} | {after} | {} |\n", in_words(&heard));
        }
    }
    page
}

const HEAD: &str = "\
# Every state × everything that can happen

This page lists, for each state of the device, what every event does. *then* is the state afterwards
(– means that it stays), *it says* is the event that the host receives (– means none).

A test makes the page from the guard itself (`firmware/src/safety/guard/mod.rs`), which is the same
on board and simulators, and fails if the page is not what the code does:

    FLEXOR_OVERWRITE=1 cargo test -p firmware --lib states     # renews it: read the diff

One channel wants 5 mA of the 20 that it may have, once armed; stop and key are closed unless a row
says otherwise; in Checking both phases have been read. The time that is up is 11 s: the electrode
check's end, 10 s after arming, the host's silence, the end of the fall or of the last grounding.
Hosts see Checking as Idle, Grounding as Fault ([protocol](../protocol.md)). *Stopping at once* is the stop of an
opened hand-held stop or key: its amplitude is 0 at once, where *Stopping* falls.

A second test plays every three events in a row from every state, 72,000 of them, and
holds: a pulse begins in Checking, Stimulating and Stopping only, and nowhere without the
pump; Stimulating is entered by `start` from Armed alone, Armed from Checking alone; after
`stop` nothing rises or waits to start; a fault is left by `acknowledge` alone; nobody's
order is more than the limit; an opened stop ends every stimulation.
";

#[test]
fn the_page_of_states_is_what_the_guard_does() {
    let page = page();
    if std::env::var_os("FLEXOR_OVERWRITE").is_some() {
        std::fs::write(PAGE, &page).unwrap();
    }
    let committed = std::fs::read_to_string(PAGE).unwrap_or_default();
    assert!(
        committed == page,
        "docs/reference/states.md is not what the guard does: if that is meant, \
         FLEXOR_OVERWRITE=1 cargo test -p firmware --lib states"
    );
}

/// Checks the invariants after one step, whatever came before.
fn hold(before: &str, event: &str, guard: &mut Guard, now: Micros, way: &str) {
    let after = place(guard);
    let is_pumped = matches!(
        after,
        "Checking" | "Armed" | "Stimulating" | "Stopping" | "Stopping at once"
    );
    assert_eq!(guard.is_pump_on(), is_pumped, "{way}: the pump in {after}");
    let may_begin = matches!(after, "Checking" | "Stimulating" | "Stopping");
    let begins = pulses(guard, now);
    assert!(!begins || may_begin, "{way}: a pulse begins in {after}");
    let limit = Amplitude::new(20_000);
    assert!(
        guard.stimulus_in_force(0).amplitude <= limit,
        "{way}: above the limit"
    );
    let from = |state: &str| after == before || state == before;
    match after {
        "Stimulating" => assert!(
            from("Armed") && (after == before || event == "`start`"),
            "{way}"
        ),
        "Armed" => assert!(from("Checking"), "{way}"),
        "Checking" => assert!(from("Idle"), "{way}"),
        _ => {}
    }
    let is_live = matches!(after, "Checking" | "Armed" | "Stimulating");
    if matches!(event, "`stop`" | "the stop opens" | "both open") {
        assert!(!is_live, "{way}: {after}");
    }
    match before {
        "Fault" if event != "`acknowledge`" => assert_eq!(after, "Fault", "{way}"),
        "Fault" => assert_eq!(after, "Grounding", "{way}"),
        "Grounding" => assert!(matches!(after, "Grounding" | "Idle" | "Fault"), "{way}"),
        _ => {}
    }
}

#[test]
fn no_three_events_break_what_the_states_promise() {
    let mut played = 0;
    let count = EVENTS.len();
    for state in STATES {
        for way in 0..count.pow(3) {
            let chosen = [way / count / count, way / count % count, way % count];
            let (mut guard, scheduler) = wanting(state);
            let mut now = then(state);
            for (done, index) in chosen.into_iter().enumerate() {
                let (event, happens) = EVENTS[index];
                let before = place(&guard);
                happens(&mut guard, &scheduler, now);
                if event == "its time is up" {
                    now += us(11_000_000);
                }
                let names = || chosen[..=done].iter().map(|k| EVENTS[*k].0);
                let way = || format!("{state}: {:?}", names().collect::<Vec<_>>());
                hold(before, event, &mut guard, now, &way());
                now += us(WINDOW_US);
            }
            played += 1;
        }
    }
    assert_eq!(played, 72_000);
}
