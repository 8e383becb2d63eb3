//! Options that select the wearer of a study or chart.

use clap::Args;
use studies::hamana2022::paper::Source;

/// Forearms that the participants of Hamana 2022 can have.
const SOURCES: [&str; 5] = ["posterior", "strict", "prior", "below", "fixed"];

/// Options that select the forearms of Hamana 2022's participants.
#[derive(Args, Debug, Default)]
pub struct ForearmArgs {
    /// Forearms of Hamana 2022's participants (docs/evidence/participants.md); default: posterior
    #[arg(long, value_parser = SOURCES)]
    participants: Option<String>,
    /// Name of an ablation of hamana-1 to hamana-4 (docs/evidence/two_points.md)
    #[arg(long)]
    ablation: Option<String>,
}

impl ForearmArgs {
    /// Returns the selected forearms.
    pub fn source(&self) -> Option<Source> {
        self.participants.as_deref().and_then(Source::from_name)
    }

    /// Returns the name of the ablation.
    pub fn ablation(&self) -> Option<&str> {
        self.ablation.as_deref()
    }
}

/// Letters of the participants of Hamana 2022, and all of them.
pub const PARTICIPANTS: [&str; 5] = ["P", "Q", "R", "S", "all"];

#[derive(Args, Debug, Default)]
pub struct WearerArgs {
    /// Wearer file, or the name of a shipped one (docs/reference/wearers.md)
    #[arg(long, value_name = "FILE")]
    wearer: Option<String>,
    /// Participant of Hamana 2022, or all four (docs/evidence/two_points.md)
    #[arg(long, value_parser = PARTICIPANTS, conflicts_with = "wearer")]
    participant: Option<String>,
}

impl WearerArgs {
    /// Returns the participant's letter, or the file.
    pub fn name(&self) -> Option<&str> {
        self.participant.as_deref().or(self.wearer.as_deref())
    }
}
