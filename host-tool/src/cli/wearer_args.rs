//! Options that select the wearer of a study or chart.

use clap::Args;

/// Letters of the participants of Hamana 2022, and all of them.
pub const PARTICIPANTS: [&str; 5] = ["P", "Q", "R", "S", "all"];

#[derive(Args, Debug, Default)]
pub struct WearerArgs {
    /// Wearer file, or the name of a shipped one (docs/wearers.md)
    #[arg(long, value_name = "FILE")]
    wearer: Option<String>,
    /// Participant of Hamana 2022, or all four (docs/two_points.md)
    #[arg(long, value_parser = PARTICIPANTS, conflicts_with = "wearer")]
    participant: Option<String>,
}

impl WearerArgs {
    /// Returns the participant's letter, or the file.
    pub fn name(&self) -> Option<&str> {
        self.participant.as_deref().or(self.wearer.as_deref())
    }
}
