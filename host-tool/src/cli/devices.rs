//! `flexor devices`: the boards on the USB ports of this computer.

use super::Output;
use clap::Args;
use dfu::usb::{self, Listed};
use firmware::link::{USB_IDS, USB_MANUFACTURER};
use host_core::link::{FlexorPort, flexor_ports};
use serde_json::json;

/// List the boards and boot loaders on this computer's USB ports
///
/// No device is opened. A device is found by its USB id; kind and board are those that it reports.
#[derive(Args, Debug)]
pub struct DevicesArgs {}

/// A board or a boot loader.
#[derive(Debug)]
struct ConnectedDevice {
    /// Port by which `--device` opens the board; `None` for a boot loader.
    port: Option<String>,
    /// Name that the device reports to USB.
    product: String,
    serial: String,
    version: String,
}

/// A computer whose operating system lists no USB devices, such as a container, has none.
///
/// # Errors
/// Fails if the output cannot be written.
pub fn main(_: &DevicesArgs, output: Output) -> anyhow::Result<()> {
    let listed = usb::list_boards(USB_IDS, USB_MANUFACTURER).unwrap_or_default();
    let (boot_loaders, failure) = match usb::list() {
        Ok(found) => (found, None),
        Err(why) => (Vec::new(), Some(why.to_string())),
    };
    let mut found: Vec<ConnectedDevice> = flexor_ports()
        .iter()
        .map(|port| board(port, &listed))
        .collect();
    found.extend(boot_loaders.into_iter().map(|device| ConnectedDevice {
        port: None,
        product: "STM32 boot loader".to_owned(),
        serial: device.serial.unwrap_or_default(),
        version: String::new(),
    }));
    output.print(
        || match found.as_slice() {
            [] => match &failure {
                Some(why) => format!("no board is connected: {why}"),
                None => "no board is connected; a board without a listed port may need the rules \
                         of flexor board udev"
                    .to_owned(),
            },
            found => table(found),
        },
        || {
            let rows = found.iter().map(|device| {
                json!({
                    "device": device.port,
                    "product": device.product,
                    "serial": device.serial,
                    "version": device.version,
                })
            });
            json!({ "devices": rows.collect::<Vec<_>>() })
        },
    )
}

fn board(port: &FlexorPort, listed: &[Listed]) -> ConnectedDevice {
    let same = |device: &&Listed| device.serial.as_deref() == port.serial.as_deref();
    let version = listed.iter().find(same).map(|device| device.version);
    ConnectedDevice {
        port: Some(port.path.clone()),
        product: port.product.clone(),
        serial: port.serial.clone().unwrap_or_default(),
        version: version.map_or_else(String::new, |[major, minor, patch]| {
            format!("{major}.{minor}.{patch}")
        }),
    }
}

/// Returns the table for people, two lines for each device.
fn table(found: &[ConnectedDevice]) -> String {
    let lines = found.iter().map(|device| {
        let port = device.port.as_deref().unwrap_or("(flexor flash)");
        format!(
            "{port}\n    {} {}  serial {}",
            device.product, device.version, device.serial
        )
    });
    lines.collect::<Vec<_>>().join("\n")
}
