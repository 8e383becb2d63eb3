//! Wrapper of the USB driver that rejects requests on which the stack would panic.

use core::future::{Future, poll_fn};
use core::pin::pin;
use core::task::{Context, Poll};
use embassy_usb::driver::{
    ControlPipe, Driver, EndpointAddress, EndpointAllocError, EndpointError, EndpointType,
};

/// Number of endpoints of OTG_FS in each direction, endpoint 0 included (RM0090 section 34.4.1).
const ENDPOINTS: u8 = 4;
/// Longest packet of endpoint 0, bytes.
const PACKET: usize = 64;

/// USB driver that hides requests about endpoints that the controller does not have. Stack and
/// driver would panic when asked for the state of such an endpoint or to halt it, and any program
/// may ask.
pub struct CheckedDriver<D>(pub D);

impl<'d, D: Driver<'d>> Driver<'d> for CheckedDriver<D> {
    type EndpointOut = D::EndpointOut;
    type EndpointIn = D::EndpointIn;
    type ControlPipe = CheckedPipe<D::ControlPipe>;
    type Bus = D::Bus;

    fn alloc_endpoint_out(
        &mut self,
        kind: EndpointType,
        address: Option<EndpointAddress>,
        packet: u16,
        interval_ms: u8,
    ) -> Result<Self::EndpointOut, EndpointAllocError> {
        self.0
            .alloc_endpoint_out(kind, address, packet, interval_ms)
    }

    fn alloc_endpoint_in(
        &mut self,
        kind: EndpointType,
        address: Option<EndpointAddress>,
        packet: u16,
        interval_ms: u8,
    ) -> Result<Self::EndpointIn, EndpointAllocError> {
        self.0.alloc_endpoint_in(kind, address, packet, interval_ms)
    }

    fn start(self, control_packet: u16) -> (Self::Bus, Self::ControlPipe) {
        let (bus, pipe) = self.0.start(control_packet);
        let pipe = CheckedPipe {
            pipe,
            awaits_data: false,
        };
        (bus, pipe)
    }
}

/// Endpoint 0, which answers requests about missing endpoints by STALL (USB 2.0 sections 9.4.1,
/// 9.4.5, 9.4.9).
pub struct CheckedPipe<P> {
    pipe: P,
    /// Whether the last request announced data from the host, or failed.
    awaits_data: bool,
}

impl<P: ControlPipe> CheckedPipe<P> {
    /// Polls for the next SETUP packet, and drops data that came before it. Such data belong to a
    /// request that was refused for its length, or whose host left. If they were kept, they would
    /// be taken for the next request's data, or every read would fail, because the driver then
    /// expects an empty packet and keeps a longer one forever. Data that no request announced make
    /// only the next read fail. Both futures hold no state between two polls.
    fn next_setup(&mut self, cx: &mut Context<'_>) -> Poll<[u8; 8]> {
        if self.awaits_data {
            let mut rest = [0; PACKET];
            let _ = pin!(self.pipe.data_out(&mut rest, true, true)).poll(cx);
        }
        pin!(self.pipe.setup()).poll(cx)
    }
}

impl<P: ControlPipe> ControlPipe for CheckedPipe<P> {
    fn max_packet_size(&self) -> usize {
        self.pipe.max_packet_size()
    }

    /// Waits for the next request that the stack can handle. Dropping the future loses nothing,
    /// because refusing does not wait.
    async fn setup(&mut self) -> [u8; 8] {
        loop {
            let request = poll_fn(|cx| self.next_setup(cx)).await;
            self.awaits_data = sends_data(&request);
            if !is_of_no_endpoint(&request) {
                return request;
            }
            self.pipe.reject().await;
        }
    }

    async fn data_out(
        &mut self,
        buffer: &mut [u8],
        first: bool,
        last: bool,
    ) -> Result<usize, EndpointError> {
        self.pipe.data_out(buffer, first, last).await
    }

    async fn data_in(&mut self, data: &[u8], first: bool, last: bool) -> Result<(), EndpointError> {
        let result = self.pipe.data_in(data, first, last).await;
        self.awaits_data |= result.is_err();
        result
    }

    async fn accept(&mut self) {
        self.pipe.accept().await;
    }

    async fn reject(&mut self) {
        self.pipe.reject().await;
    }

    async fn accept_set_address(&mut self, address: u8) {
        self.pipe.accept_set_address(address).await;
    }
}

/// Returns whether the host sends data with `request`, from bmRequestType's direction and wLength
/// (USB 2.0 table 9-2).
fn sends_data(&[kind, _, _, _, _, _, length @ ..]: &[u8; 8]) -> bool {
    kind & 0x80 == 0 && u16::from_le_bytes(length) > 0
}

/// Returns whether the request is a standard request (bmRequestType, either direction) for an
/// endpoint whose number, the lowest bits of wIndex, the controller does not have (USB 2.0 section
/// 9.3, figure 9-2).
fn is_of_no_endpoint(&[kind, _, _, _, index, ..]: &[u8; 8]) -> bool {
    kind & 0x7F == 0x02 && index & 0x0F >= ENDPOINTS
}
