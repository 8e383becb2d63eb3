//! The bus served for ever, also where the host leaves in the middle of a request.

use super::pac::USB_OTG_FS;
use core::convert::Infallible;
use core::future::poll_fn;
use core::task::Poll;
use embassy_futures::select::select;
use embassy_stm32::interrupt::typelevel::{Handler, OTG_FS};
use embassy_sync::waitqueue::AtomicWaker;
use embassy_usb::UsbDevice;
use embassy_usb::driver::Driver;

static HOST_LEFT: AtomicWaker = AtomicWaker::new();

/// Wakes the bus within a transfer too: the driver's handler wakes who looks at the bus, and
/// then nobody does.
pub struct WakeHandler;

impl Handler<OTG_FS> for WakeHandler {
    // SAFETY: of any context; it reads a register that reading does not change.
    unsafe fn on_interrupt() {
        if is_host_gone() {
            HOST_LEFT.wake();
        }
    }
}

/// Serves the bus and endpoint 0.
///
/// The stack looks at the bus between two control transfers only, and its driver for this
/// controller waits within one for the host's next packet, whatever happens to the bus. A
/// cable that was out, or a reset, in a transfer would be seen never: the port stayed dead
/// until power went. Such a transfer is dropped here, and the stack finds what happened.
pub async fn serve<'d, D: Driver<'d>>(usb: &mut UsbDevice<'d, D>) -> Infallible {
    loop {
        select(usb.run(), host_left()).await;
        withdraw_answer();
    }
}

/// Ready when [`is_host_gone`]: asked after the stack has run, so the stack is within a
/// transfer, or it just happened and the stack will see it as well without this.
async fn host_left() {
    poll_fn(|cx| {
        HOST_LEFT.register(cx.waker());
        if is_host_gone() {
            Poll::Ready(())
        } else {
            Poll::Pending
        }
    })
    .await
}

/// Whether the cable went or came, or the bus was reset, fell asleep or woke, and nobody has
/// seen it: all for which the driver's handler masks what follows until the bus is looked at.
fn is_host_gone() -> bool {
    let events = USB_OTG_FS.gintsts().read();
    let is_cable = events.srqint() || events.otgint();
    let is_reset = events.usbrst() || events.enumdne();
    is_cable || is_reset || events.usbsusp() || events.wkupint()
}

/// Forgets what endpoint 0 was about when the bus was reset: a request that had come, and was
/// looked at only after, armed an answer and may have set an address.
pub struct Forget;

impl embassy_usb::Handler for Forget {
    fn reset(&mut self) {
        withdraw_answer();
        USB_OTG_FS.dcfg().modify(|w| w.set_dad(0));
    }
}

/// What endpoint 0 was to send to a host that left. A reset of the bus leaves it armed, and
/// the next answer would wait for it (RM0090 section 34.16.4, EPENA and EPDIS).
fn withdraw_answer() {
    let control = USB_OTG_FS.diepctl(0);
    if control.read().epena() {
        control.modify(|w| {
            w.set_snak(true);
            w.set_epdis(true);
        });
    }
}
