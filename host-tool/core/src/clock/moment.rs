//! Date and time of day.

use std::time::Duration;

const SECONDS_PER_DAY: i64 = 86_400;

/// A date and time of day by the computer's clock. The default is 1970-01-01, for programs that
/// have no clock.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Moment {
    /// Time since 1970-01-01 00:00:00 UTC, without leap seconds.
    pub since_1970: Duration,
    /// Local time minus UTC at this moment, s.
    pub local_offset_s: i32,
}

impl Moment {
    /// Returns coordinated universal time in the format of RFC 3339, to the millisecond (cut, not
    /// rounded): `2026-11-27T13:47:36.125Z`.
    #[must_use]
    pub fn utc(self) -> String {
        let (date, time) = date_and_time(self.seconds());
        let [hour, minute, second] = time;
        let millis = self.since_1970.subsec_millis();
        format!("{date}T{hour:02}:{minute:02}:{second:02}.{millis:03}Z")
    }

    /// Returns local date and time in the form that names of record folders have:
    /// `2026-11-27-134736`.
    #[must_use]
    pub fn local_stamp(self) -> String {
        let local_s = self.seconds().saturating_add(self.local_offset_s.into());
        let (date, [hour, minute, second]) = date_and_time(local_s);
        format!("{date}-{hour:02}{minute:02}{second:02}")
    }

    /// Returns the whole seconds since 1970-01-01 UTC.
    fn seconds(self) -> i64 {
        i64::try_from(self.since_1970.as_secs()).unwrap_or(i64::MAX)
    }
}

/// Returns the date, such as `2026-11-27`, and hour, minute and second, for `seconds` since 1970.
fn date_and_time(seconds: i64) -> (String, [i64; 3]) {
    let (year, month, day) = civil_from_days(seconds.div_euclid(SECONDS_PER_DAY));
    let second = seconds.rem_euclid(SECONDS_PER_DAY);
    let time = [second / 3600, second / 60 % 60, second % 60];
    (format!("{year:04}-{month:02}-{day:02}"), time)
}

/// Returns year, month and day of the Gregorian calendar, `days` after 1970-01-01.
///
/// The method is `civil_from_days` of H. Hinnant, "chrono-Compatible Low-Level Date Algorithms"
/// (2013): years begin in March, so that the leap day is a year's last day.
const fn civil_from_days(days: i64) -> (i64, i64, i64) {
    let from_march_0000 = days + 719_468;
    let era = from_march_0000.div_euclid(146_097); // 400 years
    let day_of_era = from_march_0000.rem_euclid(146_097);
    let year_of_era =
        (day_of_era - day_of_era / 1_460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month_from_march = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month_from_march + 2) / 5 + 1;
    let (month, in_next_year) = match month_from_march < 10 {
        true => (month_from_march + 3, 0),
        false => (month_from_march - 9, 1),
    };
    (year_of_era + era * 400 + in_next_year, month, day)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(seconds: u64, millis: u64, local_offset_s: i32) -> Moment {
        Moment {
            since_1970: Duration::from_millis(seconds * 1000 + millis),
            local_offset_s,
        }
    }

    /// Checks dates against the output of `date --utc --date @SECONDS`.
    #[test]
    fn dates_are_those_of_the_calendar() {
        for (seconds, date) in [
            (0, "1970-01-01T00:00:00.000Z"),
            (951_782_399, "2000-02-28T23:59:59.000Z"),
            (951_782_400, "2000-02-29T00:00:00.000Z"),
            (951_868_800, "2000-03-01T00:00:00.000Z"),
            (1_709_164_800, "2024-02-29T00:00:00.000Z"),
            (1_735_689_599, "2024-12-31T23:59:59.000Z"),
            (4_107_542_400, "2100-03-01T00:00:00.000Z"),
        ] {
            assert_eq!(at(seconds, 0, 0).utc(), date);
        }
    }

    #[test]
    fn parts_of_a_second_are_cut() {
        let moment = Moment {
            since_1970: Duration::new(1_795_787_256, 999_999_999),
            local_offset_s: 0,
        };
        assert_eq!(moment.utc(), "2026-11-27T13:47:36.999Z");
    }

    #[test]
    fn a_folder_has_the_local_date() {
        let east = at(1_735_689_599, 5, 3_600);
        assert_eq!(east.local_stamp(), "2025-01-01-005959");
        let west = at(1_735_689_600, 0, -34_200);
        assert_eq!(west.local_stamp(), "2024-12-31-143000");
        assert_eq!(at(0, 0, -1).local_stamp(), "1969-12-31-235959");
    }
}
