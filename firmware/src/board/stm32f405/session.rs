//! The Session's context: the thread, between the USB serial port and the
//! mailboxes.

use super::backup::Backup;
use super::control::TOLD;
use super::stages;
use super::timebase;
use super::usb_bus;
use super::usb_clock::UsbClock;
use super::usb_driver::CheckedDriver;
use super::watchdog::{self, Owner};
use crate::device::{Session, SessionMail};
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

/// Full-speed bulk packets.
const PACKET: usize = 64;
/// Bytes on their way to the host: the longest frame and a little telemetry.
const PIPE: usize = 1024;
/// pid.codes' identity for tests. A product needs its own: until then hosts
/// look for the product's name.
const VID_PID: (u16, u16) = (0x1209, 0x0001);

/// Turns of the loop, each at most a millisecond, that an accepted stage table waits
/// for its answer to leave; half of them in any case, for what USB still holds.
const PATIENCE: u8 = 40;

type Usb = CheckedDriver<Driver<'static, USB_OTG_FS>>;
type Bytes = Pipe<NoopRawMutex, PIPE>;

/// Pins and peripheral of the port.
pub struct Port {
    /// The peripheral.
    pub usb: Peri<'static, USB_OTG_FS>,
    /// D+.
    pub dp: Peri<'static, PA12>,
    /// D−.
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

/// Serves the link for ever: the bus in this task, the session in one of its own, so that a
/// tick's wake does not look at the bus.
///
/// # Panics
/// When called twice.
pub async fn serve(
    spawner: Spawner,
    session: &'static mut Session,
    mail: SessionMail<'static>,
    backup: Backup,
    port: Port,
) -> Infallible {
    let (mut usb, class) = build(port);
    let (tx, rx) = class.split();
    // Proof: the task's one slot is free, for nothing else spawns it.
    spawner.spawn(run(session, mail, backup, tx, rx).expect("spawned here only"));
    usb_bus::serve(&mut usb).await
}

/// First polled after the bus.
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
    // PA9 sees VBUS: a device with its own supply may not pull D+ up without
    // it (USB 2.0 section 7.1.5).
    hardware.vbus_detection = true;
    let driver = Driver::new_fs(
        port.usb,
        Irqs,
        port.dp,
        port.dm,
        &mut memory.endpoints,
        hardware,
    );
    let mut config = embassy_usb::Config::new(VID_PID.0, VID_PID.1);
    config.manufacturer = Some("Flexor");
    config.product = Some("Flexor stimulator");
    config.serial_number = Some(embassy_stm32::uid::uid_hex());
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

/// Bytes from the host to the session as they come, and what the session has to say
/// after each control tick, which has told it. Never waits for the host to read.
async fn converse(
    session: &mut Session,
    mut mail: SessionMail<'static>,
    mut backup: Backup,
    mut rx: Receiver<'static, Usb>,
    outgoing: &Bytes,
) -> Infallible {
    // From here on: the USB core, polled before, waits up to 25 ms as it starts
    // (RM0090 section 34.17.3), and without a session nothing can be armed.
    watchdog::start();
    let mut usb_clock = UsbClock::new();
    let mut packet = [0; PACKET];
    let mut patience = PATIENCE;
    loop {
        if let Either::First(count) = select(receive(&mut rx, &mut packet), TOLD.wait()).await {
            // `receive` counts bytes of `packet`.
            let bytes = packet.get(..count).unwrap_or(&packet);
            let now = timebase::now();
            // A packet may end several requests, and one may take a muscle's
            // table, up to 2 ms: each is a sign of life.
            for frame in bytes.split_inclusive(|&byte| byte == 0) {
                session.receive(now, frame, &mut mail);
                watchdog::check_in(Owner::Session);
            }
        }
        usb_clock.look();
        // Before the session says that it is armed.
        while let Some(entry) = mail.take_entry() {
            backup.write(&entry);
        }
        session.poll(timebase::now(), &mut mail);
        transmit(session, outgoing);
        store_stages(session, outgoing, &mut patience);
        watchdog::check_in(Owner::Session);
    }
}

/// Stores a table that was accepted, once its answer is out or nobody reads it.
fn store_stages(session: &Session, outgoing: &Bytes, patience: &mut u8) {
    let Some(table) = session.stage_table_to_store() else {
        return;
    };
    *patience = patience.saturating_sub(1);
    let is_out = outgoing.is_empty() && !session.has_output() && *patience <= PATIENCE / 2;
    if is_out || *patience == 0 {
        stages::store(table);
    }
}

/// The next packet, however long the port is closed before it. Dropping this
/// future loses nothing: a packet stays in the endpoint until it is read.
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
        // The pipe takes bytes up to the end of its ring only, so it may take
        // two goes. All fit: the free capacity was asked first, and no one else
        // writes.
        while let Ok(taken) = outgoing.try_write(rest) {
            rest = rest.get(taken..).unwrap_or_default();
            if rest.is_empty() {
                break;
            }
        }
    }
}

/// From the pipe to the host. Bytes for a port that closes are dropped: the
/// next session begins with a frame of its own.
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
            // A full packet promises more; an empty one says there is none
            // (USB 2.0 section 5.8.3).
            if count == PACKET && outgoing.is_empty() && tx.write_packet(&[]).await.is_err() {
                break;
            }
        }
    }
}
