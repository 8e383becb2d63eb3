//! Methods for the requests that a device acknowledges, one for each.

use super::{Connection, Error, Port};
use firmware::control::JointSpec;
use firmware::link::Request;
use firmware::muscle::{MuscleLevel, MuscleSpec};
use firmware::pulse::{CHANNELS, GroupSpec, MAX_GROUPS};
use firmware::safety::{ChannelSpec, ListedPulse, MAX_LISTED, StageKind, StageSupply, WearerSpec};
use firmware::units::{Amplitude, Micros};

/// Generates methods that send a request, wait for its acknowledgement and return the device time
/// of the acknowledgement, µs. Each entry gives the documentation of the method, the name of the
/// request for errors, the method with its arguments, and the request.
macro_rules! requests {
    ($($doc:literal $name:literal $method:ident($($argument:ident: $type:ty),*) $request:expr;)*) => {
        impl<P: Port> Connection<P> {
            $(
                #[doc = $doc]
                ///
                /// # Errors
                /// Refused, not answered, or the device is lost.
                pub fn $method(&mut self, $($argument: $type),*) -> Result<u64, Error> {
                    self.ack($name, $request)
                }
            )*
        }
    };
}

requests! {
    "Tells the device that the host is alive."
    "KeepAlive" keep_alive() Request::KeepAlive;
    "Clears the draft setup."
    "Clear" clear() Request::Clear;
    "Sets the wearer's limits in the draft."
    "Wearer" wearer(spec: WearerSpec) Request::Wearer(spec);
    "Configures a channel (from 0) in the draft."
    "Channel" channel(channel: u8, spec: ChannelSpec) Request::Channel { channel, spec };
    "Chooses the channel that drives the sync output."
    "Sync" sync(channel: Option<u8>) Request::Sync { channel };
    "Configures a muscle on a channel, whose force the device predicts."
    "Muscle" muscle(channel: u8, spec: MuscleSpec) Request::Muscle { channel, spec };
    "Changes the model level of an armed muscle."
    "MuscleLevel" muscle_level(channel: u8, level: MuscleLevel) Request::MuscleLevel { channel, level };
    "Configures the controlled joint in the draft."
    "Joint" joint(spec: JointSpec) Request::Joint(spec);
    "Starts the armed trains."
    "Start" start() Request::Start;
    "Ends stimulation or disarms."
    "Stop" stop() Request::Stop;
    "Stores the board's output stages, by channel, and their supply, after which it restarts."
    "StoreStages" store_stages(stages: [Option<StageKind>; CHANNELS], supply: StageSupply)
    Request::StoreStages { stages, supply };
    "Restarts a breadboard in the boot loader of its chip."
    "EnterBootLoader" enter_boot_loader() Request::EnterBootLoader;
    "Acknowledges a fault."
    "Acknowledge" acknowledge() Request::Acknowledge;
    "Sets the reference angle, 0.01°, and its rate, 0.01 °/s."
    "Angle" angle(at: Option<Micros>, centideg: i16, rate: Option<i32>)
    Request::Angle { at, centideg, centideg_per_s: rate };
    "Sends an angle that the host measured, 0.01°."
    "Measurement" measurement(centideg: i16, at: Micros)
    Request::Measurement { joint: 0, centideg, at };
    "Sets the reference force at the hand, mN."
    "Wrench" wrench(at: Option<Micros>, force_mn: [i32; 3]) Request::Wrench { at, force_mn };
    "Subscribes to telemetry every `period_ms`; 0 ends it."
    "Subscribe" subscribe(period_ms: u16) Request::Subscribe { period_ms };
    "Sends any request."
    "request" request(request: Request) request;
}

impl<P: Port> Connection<P> {
    /// Groups channels in the draft setup. While one member of a group outputs a pulse, its other
    /// members are either grounded or disconnected, as the group's specification says.
    ///
    /// # Errors
    /// The errors of every request here; [`Error::TooLarge`] for more than five groups.
    pub fn set_groups(&mut self, groups: &[GroupSpec]) -> Result<u64, Error> {
        if groups.len() > MAX_GROUPS {
            return Err(Error::TooLarge("Groups"));
        }
        let groups = groups.iter().copied().collect();
        self.ack("Groups", Request::Groups(groups))
    }

    /// Sets amplitudes, each with its channel (from 0). Pulse widths stay those of the trains. The
    /// order of the list does not matter, and the device accepts all amplitudes or none.
    ///
    /// # Errors
    /// The errors of every request here; [`Error::TooLarge`] for more than ten amplitudes.
    pub fn set_amplitudes(&mut self, list: &[(u8, Amplitude)]) -> Result<u64, Error> {
        let list = list.iter();
        let own: Vec<_> = list
            .map(|&(channel, amplitude)| (channel, amplitude, None))
            .collect();
        self.send_amplitudes(&own)
    }

    /// Sets amplitudes and pulse widths as (channel from 0, amplitude, width in µs). Each pair
    /// takes effect at the channel's next burst. The order of the list does not matter, and the
    /// device accepts all entries or none.
    ///
    /// # Errors
    /// The errors of every request here; [`Error::TooLarge`] for more than ten amplitudes.
    pub fn set_stimuli(&mut self, list: &[(u8, Amplitude, u16)]) -> Result<u64, Error> {
        let list = list.iter();
        let pairs: Vec<_> = list
            .map(|&(channel, amplitude, us)| (channel, amplitude, Some(us)))
            .collect();
        self.send_amplitudes(&pairs)
    }

    /// Plays a list of pulses on a channel (from 0) once, starting at the channel's next burst.
    ///
    /// # Errors
    /// The errors of every request here; [`Error::TooLarge`] for more than sixteen pulses.
    pub fn play_pulses(&mut self, channel: u8, pulses: &[ListedPulse]) -> Result<u64, Error> {
        if pulses.len() > MAX_LISTED {
            return Err(Error::TooLarge("Pulses"));
        }
        let pulses = pulses.iter().copied().collect();
        self.ack("Pulses", Request::Pulses { channel, pulses })
    }

    /// Sends amplitudes. Either all of them have a pulse width in µs, or none has.
    fn send_amplitudes(&mut self, list: &[(u8, Amplitude, Option<u16>)]) -> Result<u64, Error> {
        if list.len() > CHANNELS {
            return Err(Error::TooLarge("Amplitudes"));
        }
        // The device refuses a channel that is named twice.
        let mut sorted = list.to_vec();
        sorted.sort_by_key(|(channel, ..)| *channel);
        let mask = sorted.iter().fold(0, |mask, (channel, ..)| {
            mask | 1u16.checked_shl((*channel).into()).unwrap_or(0)
        });
        let request = Request::Amplitudes {
            at: None,
            mask,
            values: sorted.iter().map(|(_, amplitude, _)| *amplitude).collect(),
            widths: sorted
                .iter()
                .filter_map(|(.., width_us)| *width_us)
                .collect(),
        };
        self.ack("Amplitudes", request)
    }
}
