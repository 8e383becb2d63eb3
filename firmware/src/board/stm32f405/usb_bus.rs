//! Service of the USB bus that survives a host leaving in the middle of a request.

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

/// Interrupt handler that wakes the bus task during a control transfer too; the driver's own
/// handler wakes only a task that waits for bus events.
pub struct WakeHandler;

impl Handler<OTG_FS> for WakeHandler {
    // SAFETY: callable from any context; reads a register that reading does not change.
    unsafe fn on_interrupt() {
        if is_host_gone() {
            HOST_LEFT.wake();
        }
    }
}

/// Serves the bus and endpoint 0.
///
/// The stack handles bus events only between two control transfers. Within a transfer, its driver
/// waits for the host's next packet, whatever happens on the bus. A disconnected cable or a reset
/// during a transfer would never be noticed, and the port would stay dead until power is removed.
/// This function drops such a transfer, and the stack then finds the event.
pub async fn serve<'d, D: Driver<'d>>(usb: &mut UsbDevice<'d, D>) -> Infallible {
    loop {
        select(usb.run(), host_left()).await;
        withdraw_answer();
    }
}

/// Waits until [`is_host_gone`]. The stack runs first, so an unhandled event means that the stack
/// is within a transfer, or that the event has just occurred and the stack will handle it anyway.
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

/// Returns whether an unhandled bus event is pending: cable connected or removed, bus reset,
/// suspend or wake-up. For each of them the driver's handler masks further events until the bus is
/// polled.
fn is_host_gone() -> bool {
    let events = USB_OTG_FS.gintsts().read();
    let is_cable = events.srqint() || events.otgint();
    let is_reset = events.usbrst() || events.enumdne();
    is_cable || is_reset || events.usbsusp() || events.wkupint()
}

/// Interrupt handler that clears the state of endpoint 0 after a bus reset. A request received
/// before the reset but handled after it may have armed an answer or set an address.
pub struct Forget;

impl embassy_usb::Handler for Forget {
    fn reset(&mut self) {
        withdraw_answer();
        USB_OTG_FS.dcfg().modify(|w| w.set_dad(0));
    }
}

/// Withdraws endpoint 0's pending answer to a host that has left. A bus reset leaves it armed, and
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
