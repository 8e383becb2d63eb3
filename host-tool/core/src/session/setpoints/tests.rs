use super::*;

fn angle(setpoints: &Setpoints, t_us: u64) -> (i16, i32) {
    match setpoints.at(t_us) {
        Setpoint::Angle {
            centideg,
            centideg_per_s,
        } => (centideg, centideg_per_s),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_sine_turns_where_it_should() {
    let sine = Setpoints {
        rate_hz: 90.0,
        course: Course::AngleSine {
            offset_deg: 45.0,
            amplitude_deg: 40.0,
            frequency_hz: 0.2,
        },
        forces: Vec::new(),
        beside: Vec::new(),
        swings: Vec::new(),
        bounds: Vec::new(),
        lists: Vec::new(),
        programs: Programs::default(),
    };
    // The peak rate is 2π · 0.2 Hz · 40° = 50.27 °/s.
    assert_eq!(angle(&sine, 0), (4500, 5027));
    assert_eq!(angle(&sine, 1_250_000), (8500, 0));
    assert_eq!(angle(&sine, 2_500_000), (4500, -5027));
    assert_eq!(angle(&sine, 3_750_000), (500, 0));
    assert_eq!(angle(&sine, 3_600_000_000), (4500, 5027));
    assert_eq!(sine.due_us(1), 11_111);
    assert_eq!(sine.due_us(90), 1_000_000);
}

#[test]
fn a_step_holds_from_its_microsecond() {
    let steps = Setpoints {
        rate_hz: 90.0,
        course: Course::AngleSteps(vec![(0, 1000), (500_000, 6000)]),
        forces: Vec::new(),
        beside: Vec::new(),
        swings: Vec::new(),
        bounds: Vec::new(),
        lists: Vec::new(),
        programs: Programs::default(),
    };
    assert_eq!(angle(&steps, 0), (1000, 0));
    assert_eq!(angle(&steps, 499_999), (1000, 0));
    assert_eq!(angle(&steps, 500_000), (6000, 0));
    assert_eq!(angle(&steps, u64::MAX), (6000, 0));
}

#[test]
fn amplitudes_name_their_channels() {
    let own = |ua| Stimulus::with_own_width(Amplitude::new(ua));
    let values = vec![(1, own(26_000)), (4, own(0))];
    match Setpoint::Amplitudes(values).to_request(None) {
        Request::Amplitudes {
            at: None,
            mask,
            values,
            widths,
        } => {
            assert_eq!(mask, 0b10010);
            assert_eq!(values, [Amplitude::new(26_000), Amplitude::new(0)]);
            assert!(widths.is_empty());
        }
        other => panic!("{other:?}"),
    }
}
