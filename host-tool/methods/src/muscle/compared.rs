//! Which settings are compared: the methods with the arithmetics and steps that a chart shows.

use super::{Method, Number, Reading, Setting};

impl Setting {
    /// Returns every setting that is compared if the force is read every `output_us` microseconds.
    pub fn all(output_us: u32) -> impl Iterator<Item = Self> {
        let generic = Method::ALL.into_iter().flat_map(move |method| {
            Number::GENERIC.into_iter().flat_map(move |number| {
                let ended = steps_ending_at_readings(method).iter();
                let ended = ended.map(move |us| Self::new(method, number, *us));
                let planned = steps_read_by_cubics(method).iter();
                let events = steps_on_demand(method, output_us).iter();
                ended
                    .chain(planned.map(move |us| Self::planned(method, number, *us)))
                    .chain(events.map(move |us| Self::on_demand(method, number, *us)))
            })
        });
        generic
            .filter(move |setting| setting.is_of_interest(output_us))
            .chain(in_device_formats(output_us))
            .chain([Self::SEGMENTS, Self::SHIPPED])
    }

    /// Returns whether a setting is compared. Its steps must end at the readings, unless it is read
    /// through cubics or on demand. Steps below 1 ms are compared only for readings every 1 ms. f64 and
    /// micromath are compared with a few steps only, to show where they lie. Runge–Kutta with
    /// pulses at the beginning of a step is compared only as in Lee 2020. Of the other methods that
    /// integrate C by the rule of F, only Runge–Kutta in f32 is compared.
    fn is_of_interest(self, output_us: u32) -> bool {
        let Self {
            method,
            number,
            step_us,
            reading,
        } = self;
        let is_free = method.is_event_driven() || step_us == Self::WHOLE_US;
        let has_ends = reading != Reading::Steps
            || is_free
            || output_us.is_multiple_of(step_us) && (step_us >= 1000 || output_us == 1000);
        let is_shown = match number {
            Number::F64 => !(method.is_event_driven() && output_us == 1000),
            Number::Micromath => method.calls_functions(),
            _ => true,
        };
        let is_fine = matches!(step_us, 1000 | 4000 | 10_000 | Self::WHOLE_US);
        let is_usual = !matches!(number, Number::F64 | Number::Micromath);
        let is_rare = matches!(method, Method::Euler | Method::Heun)
            || method == Method::RungeKutta4Snapped
            || method.is_alike() && number != Number::F32;
        self == Self::PAPER || has_ends && is_shown && (is_usual || is_fine) && !is_rare
    }
}

/// Returns the lengths of steps that end at readings, µs; for an event-driven method, its longest
/// times without a pulse.
const fn steps_ending_at_readings(method: Method) -> &'static [u32] {
    match method {
        Method::LogFlow => &[Setting::WHOLE_US],
        _ if method.is_event_driven() => &[10_000, 20_000, Setting::WHOLE_US],
        _ => &[200, 500, 1000, 2000, 4000, 5000, 10_000, 20_000],
    }
}

/// Returns the lengths of steps that are read through their cubics, µs. The list is empty for a
/// method that integrates C by the rule of F, and for an event-driven method, which is evaluated
/// anew at every reading.
const fn steps_read_by_cubics(method: Method) -> &'static [u32] {
    if method.is_event_driven() || method.is_alike() {
        return &[];
    }
    &[2000, 4000, 6000, 8000, 10_000, 14_000, 20_000]
}

/// Returns the lengths of the longest steps on demand, µs. Readings every 1 ms leave no longer step,
/// and then only one is compared. The list is empty for a method without steps, for one with a
/// table, and for those of order 1.
const fn steps_on_demand(method: Method, output_us: u32) -> &'static [u32] {
    match method {
        Method::HeunExactC
        | Method::RungeKutta4ExactC
        | Method::HermiteSimpson
        | Method::EtdMidpoint
        | Method::GaussExponential
        | Method::RosenbrockEuler
        | Method::Rosenbrock3 => match output_us {
            1000 => &[1000],
            _ => &[4000, 6000, 8000, 10_000, 14_000, 20_000],
        },
        _ => &[],
    }
}

/// Returns the settings in the formats of the device that are not its own.
fn in_device_formats(output_us: u32) -> impl Iterator<Item = Setting> {
    Setting::IN_DEVICE_FORMATS
        .into_iter()
        .flat_map(move |method| {
            let planned = steps_read_by_cubics(method).iter();
            let events = steps_on_demand(method, output_us).iter();
            let planned = planned.map(move |us| Setting::planned(method, Number::Device, *us));
            planned.chain(events.map(move |us| Setting::on_demand(method, Number::Device, *us)))
        })
}
