//! Writes the log of the image to a file. Without the feature `rtt` there is no log.

use super::{ChipError, ChipOptions};
use hal_sim::chip::board::Surroundings;
use hal_sim::chip::image::Image;
#[cfg(feature = "rtt")]
use hal_sim::chip::rtt::{Log, Logged};
use hal_sim::lockstep::Device;

/// File to which the log of the image is written, if the user requested a log.
pub(super) struct LogFile {
    #[cfg(feature = "rtt")]
    log: Option<Log>,
}

#[cfg(feature = "rtt")]
impl LogFile {
    /// Opens the log file that `options` names. `image` is needed to decode the log.
    pub(super) fn open(options: &ChipOptions, image: &Image) -> Result<Self, ChipError> {
        let log = options.log.as_deref().map(|path| open(path, image));
        let log = log.transpose()?;
        Ok(Self { log })
    }

    /// Writes what the image has logged until now.
    pub(super) fn drain(&mut self, chip: &mut Surroundings) -> std::io::Result<()> {
        let log = self.log.as_mut();
        log.map_or(Ok(()), |log| log.drain(&mut chip.soc.ram))
    }

    /// Returns `device` so that its log is written to this file while it runs; without a log,
    /// unchanged.
    pub(super) fn attach<D>(self, device: D) -> Box<dyn Device>
    where
        D: Device + AsMut<Surroundings> + 'static,
    {
        match self.log {
            Some(log) => Box::new(Logged::new(device, log)),
            None => Box::new(device),
        }
    }
}

#[cfg(feature = "rtt")]
fn open(path: &std::path::Path, image: &Image) -> Result<Log, ChipError> {
    use std::fs::File;
    use std::io;
    let out: Box<dyn io::Write + Send> = if path == std::path::Path::new("-") {
        Box::new(io::stderr())
    } else {
        let file = File::create(path).map_err(|why| {
            let message = format!("cannot write {}: {why}", path.display());
            ChipError::Outside(io::Error::new(why.kind(), message))
        })?;
        Box::new(io::BufWriter::new(file))
    };
    Ok(Log::new(image, out)?)
}

#[cfg(not(feature = "rtt"))]
impl LogFile {
    /// Returns an empty value, because this build has no log.
    pub(super) fn open(_: &ChipOptions, _: &Image) -> Result<Self, ChipError> {
        Ok(Self {})
    }

    /// Does nothing, because this build has no log.
    pub(super) fn drain(&mut self, _: &mut Surroundings) -> std::io::Result<()> {
        Ok(())
    }

    /// Returns `device` unchanged.
    pub(super) fn attach<D>(self, device: D) -> Box<dyn Device>
    where
        D: Device + AsMut<Surroundings> + 'static,
    {
        Box::new(device)
    }
}
