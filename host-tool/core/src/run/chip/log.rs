//! The log of the image on its way to a file. Without the feature `rtt` there is none.

use super::{ChipError, ChipOptions};
use hal_sim::chip::board::Around;
use hal_sim::chip::image::Image;
#[cfg(feature = "rtt")]
use hal_sim::chip::rtt::{Log, Logged};
use hal_sim::lockstep::Device;

/// Where the log goes, if somebody wants it.
pub(super) struct LogFile {
    #[cfg(feature = "rtt")]
    log: Option<Log>,
}

#[cfg(feature = "rtt")]
impl LogFile {
    /// Opens the file that `options` name for the log of `image`.
    pub(super) fn open(options: &ChipOptions, image: &Image) -> Result<Self, ChipError> {
        let log = options.log.as_deref().map(|path| open(path, image));
        let log = log.transpose()?;
        Ok(Self { log })
    }

    /// `device`, logged.
    pub(super) fn attach<D>(self, device: D) -> Box<dyn Device>
    where
        D: Device + AsMut<Around> + 'static,
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
            let told = format!("cannot write {}: {why}", path.display());
            ChipError::Outside(io::Error::new(why.kind(), told))
        })?;
        Box::new(io::BufWriter::new(file))
    };
    Ok(Log::new(image, out)?)
}

#[cfg(not(feature = "rtt"))]
impl LogFile {
    /// Nothing to open.
    pub(super) fn open(_: &ChipOptions, _: &Image) -> Result<Self, ChipError> {
        Ok(Self {})
    }

    /// `device` as it is.
    pub(super) fn attach<D>(self, device: D) -> Box<dyn Device>
    where
        D: Device + AsMut<Around> + 'static,
    {
        Box::new(device)
    }
}
