//! The bus served for ever, also where the host leaves in the middle of a request.

use super::pac::USB_OTG_FS;
use core::convert::Infallible;
use core::future::poll_fn;
use core::task::Poll;
use embassy_futures::select::select;
use embassy_usb::UsbDevice;
use embassy_usb::driver::Driver;

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

/// Ready when the cable went or came, or the bus was reset, and nobody has seen it: asked
/// after the stack has run, so the stack is within a transfer, or it just happened and the
/// stack will see it as well without this. The driver's interrupt wakes the task.
async fn host_left() {
    poll_fn(|_| {
        let events = USB_OTG_FS.gintsts().read();
        let is_new = events.srqint() || events.otgint() || events.usbrst() || events.enumdne();
        if is_new {
            Poll::Ready(())
        } else {
            Poll::Pending
        }
    })
    .await
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
