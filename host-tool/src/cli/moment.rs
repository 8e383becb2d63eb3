//! Date and time of day, from the operating system.

use chrono::{DateTime, Local};
use host_core::clock::Moment;
use std::time::Duration;

/// Returns the present date and time.
pub fn now() -> Moment {
    moment(Local::now())
}

fn moment(at: DateTime<Local>) -> Moment {
    let micros = u64::try_from(at.timestamp_micros()).unwrap_or(0); // 0 for a clock set before 1970
    Moment {
        since_1970: Duration::from_micros(micros),
        local_offset_s: at.offset().local_minus_utc(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use chrono::{SecondsFormat, TimeZone, Utc};

    /// Compares dates three weeks and 61 s apart, from 1970 to 2200.
    #[test]
    fn dates_are_written_as_chrono_writes_them() {
        for step in 0..4_000 {
            let millis = step * 1_814_461_007;
            let local = Local.timestamp_millis_opt(millis).unwrap();
            let utc = local.with_timezone(&Utc);
            let written = utc.to_rfc3339_opts(SecondsFormat::Millis, true);
            assert_eq!(moment(local).utc(), written);
            let stamp = local.format("%Y-%m-%d-%H%M%S").to_string();
            assert_eq!(moment(local).local_stamp(), stamp);
        }
    }
}
