//! Execution context of the Session: the thread, between the USB serial port and the mailboxes.

use super::backup::Backup;
use super::control::TOLD;
use super::log::SessionLog;
use super::timebase;
use super::usb_bus;
use super::usb_clock::UsbClock;
use super::usb_driver::CheckedDriver;
use super::watchdog::{self, Owner};
use super::{front_end, pins};
use crate::board::wiring::BOARD;
use crate::device::{Session, SessionMail};
use crate::link::{USB_IDS, USB_MANUFACTURER, VERSION};
use core::convert::Infallible;
use embassy_executor::Spawner;
use embassy_futures::join::join;
use embassy_futures::select::{Either, select};
use embassy_stm32::peripherals::{PA11, PA12, USB_OTG_FS};
use embassy_stm32::usb::{self, Driver};
use embassy_stm32::{Peri, bind_interrupts};
use embassy_sync::blocking_mutex::raw::NoopRawMutex;
use embassy_sync::pipe::Pipe;
use embassy_usb::class::cdc_acm::{CdcAcmClass, Receiver, Sender, State};
use embassy_usb::{Builder, UsbDevice};
use static_cell::StaticCell;

bind_interrupts!(struct Irqs {
    OTG_FS => usb::InterruptHandler<USB_OTG_FS>, usb_bus::WakeHandler;
});

/// Size of full-speed bulk packets, bytes.
const PACKET: usize = 64;
/// Capacity for bytes on their way to the host: the longest frame and some telemetry.
const PIPE: usize = 1024;

/// Largest number of loop turns, at most a millisecond each, that an accepted restart waits until
/// its answer has left. Half of them pass in any case, for bytes that USB still holds.
const PATIENCE: u8 = 40;

type Usb = CheckedDriver<Driver<'static, USB_OTG_FS>>;
type Bytes = Pipe<NoopRawMutex, PIPE>;

/// USB peripheral and its pins.
pub struct Port {
    /// USB peripheral, OTG_FS.
    pub usb: Peri<'static, USB_OTG_FS>,
    /// D+ line.
    pub dp: Peri<'static, PA12>,
    /// D− line.
    pub dm: Peri<'static, PA11>,
}

struct Memory {
    config: [u8; 128],
    bos: [u8; 16],
    control: [u8; 64],
    endpoints: [u8; 256],
    state: State<'static>,
    forget: usb_bus::Forget,
}

/// Serves the link forever: the bus in this task and the session in its own task, so that a control
/// tick's wake-up does not poll the bus.
///
/// # Panics
/// Panics when called twice.
pub async fn serve(
    spawner: Spawner,
    session: &'static mut Session,
    mail: SessionMail<'static>,
    backup: Backup,
    port: Port,
) -> Infallible {
    let (mut usb, class) = build(port);
    let (tx, rx) = class.split();
    // Proof: the task's one slot is free, because nothing else spawns the task.
    spawner.spawn(run(session, mail, backup, tx, rx).expect("spawned here only"));
    usb_bus::serve(&mut usb).await
}

/// Session task; first polled after the bus.
#[embassy_executor::task]
async fn run(
    session: &'static mut Session,
    mail: SessionMail<'static>,
    backup: Backup,
    tx: Sender<'static, Usb>,
    rx: Receiver<'static, Usb>,
) {
    let outgoing = Bytes::new();
    join(
        send(tx, &outgoing),
        converse(session, mail, backup, rx, &outgoing),
    )
    .await;
}

fn build(port: Port) -> (UsbDevice<'static, Usb>, CdcAcmClass<'static, Usb>) {
    static MEMORY: StaticCell<Memory> = StaticCell::new();
    let memory = MEMORY.init_with(|| Memory {
        config: [0; 128],
        bos: [0; 16],
        control: [0; 64],
        endpoints: [0; 256],
        state: State::new(),
        forget: usb_bus::Forget,
    });
    let mut hardware = usb::Config::default();
    // Where PA9 senses VBUS: a self-powered device may not pull D+ up without it (USB 2.0 section
    // 7.1.5).
    hardware.vbus_detection = BOARD.senses_vbus;
    let driver = Driver::new_fs(
        port.usb,
        Irqs,
        port.dp,
        port.dm,
        &mut memory.endpoints,
        hardware,
    );
    let mut config = embassy_usb::Config::new(USB_IDS.0, USB_IDS.1);
    config.manufacturer = Some(USB_MANUFACTURER);
    config.product = Some(BOARD.product);
    // bcdDevice: major in the upper byte, minor and patch in the nibbles of the lower.
    let [major, minor, patch] = VERSION.map(u16::from);
    config.device_release = major << 8 | minor << 4 | patch;
    config.serial_number = Some(embassy_stm32::uid::uid_hex());
    config.self_powered = BOARD.breadboard.is_none();
    config.max_power = 100;
    let mut builder = Builder::new(
        CheckedDriver(driver),
        config,
        &mut memory.config,
        &mut memory.bos,
        &mut [],
        &mut memory.control,
    );
    builder.handler(&mut memory.forget);
    let class = CdcAcmClass::new(&mut builder, &mut memory.state, PACKET as u16);
    (builder.build(), class)
}

/// Passes bytes from the host to the session as they arrive, and the session's messages to the host
/// after each control tick's signal. Never waits for the host to read.
async fn converse(
    session: &mut Session,
    mut mail: SessionMail<'static>,
    mut backup: Backup,
    mut rx: Receiver<'static, Usb>,
    outgoing: &Bytes,
) -> Infallible {
    // The watchdog starts here and no earlier: the USB core, polled before, waits up to 25 ms as it
    // starts (RM0090 section 34.17.3), and nothing can be armed without a session.
    watchdog::start();
    let mut usb_clock = UsbClock::new();
    let mut log = SessionLog::new(session);
    let mut packet = [0; PACKET];
    let mut patience = PATIENCE;
    loop {
        if let Either::First(count) = select(receive(&mut rx, &mut packet), TOLD.wait()).await {
            // `receive` returns the number of bytes in `packet`.
            let bytes = packet.get(..count).unwrap_or(&packet);
            let now = timebase::now();
            // A packet may complete several requests, each of which may take up to 2 ms (a muscle's
            // table), so the session checks in after each.
            for frame in bytes.split_inclusive(|&byte| byte == 0) {
                session.receive(now, frame, &mut mail);
                watchdog::check_in(Owner::Session);
            }
        }
        usb_clock.look();
        // The allowance is written before the session reports that it is armed.
        while let Some(entry) = mail.take_entry() {
            backup.write(&entry);
        }
        session.poll(timebase::now(), &mut mail);
        log.look(session);
        transmit(session, outgoing);
        session.set_boot_loader_inputs(are_stops_open());
        restart(session, outgoing, &mut patience);
        watchdog::check_in(Owner::Session);
    }
}

/// Returns whether arm key and hand-held stop are open at their pins.
fn are_stops_open() -> bool {
    let inputs = pins::safety_inputs();
    !inputs.arm && !inputs.hand_stop
}

/// Carries out an accepted restart once its answer is out or has not been read for too long.
fn restart(session: &Session, outgoing: &Bytes, patience: &mut u8) {
    let Some(restart) = session.restart() else {
        return;
    };
    *patience = patience.saturating_sub(1);
    let is_out = outgoing.is_empty() && !session.has_output() && *patience <= PATIENCE / 2;
    if is_out || *patience == 0 {
        front_end::restart(restart);
    }
}

/// Waits for the next packet, even while the port is closed. Dropping this future loses nothing: a
/// packet stays in the endpoint until it is read.
async fn receive(rx: &mut Receiver<'static, Usb>, packet: &mut [u8; PACKET]) -> usize {
    loop {
        rx.wait_connection().await;
        if let Ok(count) = rx.read_packet(packet).await {
            return count;
        }
    }
}

fn transmit(session: &mut Session, outgoing: &Bytes) {
    if !session.has_output() {
        return;
    }
    let mut chunk = [0; PACKET];
    while outgoing.free_capacity() >= PACKET {
        let count = session.transmit(&mut chunk);
        let mut rest = chunk.get(..count).unwrap_or(&chunk);
        if rest.is_empty() {
            return;
        }
        // The pipe accepts bytes only up to the end of its ring, so this may take two writes. All
        // bytes fit: the free capacity was checked first, and this is the only writer.
        while let Ok(taken) = outgoing.try_write(rest) {
            rest = rest.get(taken..).unwrap_or_default();
            if rest.is_empty() {
                break;
            }
        }
    }
}

/// Sends bytes from the pipe to the host. Bytes for a port that closes are dropped: the next
/// session begins with a new frame.
async fn send(mut tx: Sender<'static, Usb>, outgoing: &Bytes) -> Infallible {
    let mut packet = [0; PACKET];
    loop {
        tx.wait_connection().await;
        outgoing.clear();
        loop {
            let count = outgoing.read(&mut packet).await;
            let bytes = packet.get(..count).unwrap_or(&packet);
            if tx.write_packet(bytes).await.is_err() {
                break;
            }
            // A full packet means that more follows; an empty packet ends the transfer (USB 2.0
            // section 5.8.3).
            if count == PACKET && outgoing.is_empty() && tx.write_packet(&[]).await.is_err() {
                break;
            }
        }
    }
}
