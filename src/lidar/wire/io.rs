//! Reading a lidar from a UART: a parser behind each of the embedded traits.
//!
//! | feature | trait | method |
//! | --- | --- | --- |
//! | `embedded-io` | [`embedded_io::Read`](https://docs.rs/embedded-io) | `Reader::read_packet` |
//! | `embedded-io-async` | [`embedded_io_async::Read`](https://docs.rs/embedded-io-async) | `Reader::read_packet_async` |
//! | `embedded-hal-nb` | [`embedded_hal_nb::serial::Read`](https://docs.rs/embedded-hal-nb) | `Reader::poll_packet` |
//!
//! A UART error, such as an overrun, is counted and survived: the frame it hit fails its check. Only a line that gives
//! nothing but errors is reported.

use super::protocol::Protocol;

/// UART errors in a row after which the line counts as broken.
pub const MAX_ERRORS_IN_A_ROW: u8 = 32;

/// A UART and the parser of what comes in there. At most 40 bytes more than the two.
#[derive(Debug)]
pub struct Reader<S, P> {
    serial: S,
    parser: P,
    #[cfg(any(feature = "embedded-io", feature = "embedded-io-async"))]
    buffer: Buffer,
    line_errors: u32,
    errors_in_a_row: u8,
}

/// Bytes read and not yet parsed.
#[cfg(any(feature = "embedded-io", feature = "embedded-io-async"))]
#[derive(Debug)]
struct Buffer {
    bytes: [u8; 24],
    next: u8,
    end: u8,
}

impl<S, P: Protocol> Reader<S, P> {
    /// Reads `serial` with `parser`.
    pub const fn new(serial: S, parser: P) -> Self {
        Self {
            serial,
            parser,
            #[cfg(any(feature = "embedded-io", feature = "embedded-io-async"))]
            buffer: Buffer {
                bytes: [0; 24],
                next: 0,
                end: 0,
            },
            line_errors: 0,
            errors_in_a_row: 0,
        }
    }

    /// The parser, for its counters.
    pub fn parser(&self) -> &P {
        &self.parser
    }

    /// The parser, for instance to tell it when the next bytes arrived.
    pub fn parser_mut(&mut self) -> &mut P {
        &mut self.parser
    }

    /// The UART, for instance to send a command.
    pub fn serial(&mut self) -> &mut S {
        &mut self.serial
    }

    /// Errors that the UART reported: overruns, noise, wrong stop bits; wraps.
    pub fn line_errors(&self) -> u32 {
        self.line_errors
    }

    /// Parses what was read already.
    #[cfg(any(feature = "embedded-io", feature = "embedded-io-async"))]
    fn parse_buffered(&mut self) -> Option<P::Packet> {
        let Buffer { bytes, next, end } = &mut self.buffer;
        while next < end {
            let byte = bytes.get(usize::from(*next)).copied().unwrap_or(0);
            *next += 1;
            let packet = self.parser.push(byte);
            if packet.is_some() {
                return packet;
            }
        }
        None
    }

    /// Notes what a read into the empty buffer gave; `Some` where there is nothing more to come.
    #[cfg(any(feature = "embedded-io", feature = "embedded-io-async"))]
    fn note_read<E>(&mut self, result: Result<usize, E>) -> Option<Result<Option<P::Packet>, E>> {
        match result {
            Ok(0) => Some(Ok(self.parser.pull())),
            Ok(count) => {
                self.buffer.next = 0;
                self.buffer.end = count.min(self.buffer.bytes.len()) as u8;
                self.errors_in_a_row = 0;
                None
            }
            Err(error) => self.note_error(error).map(Err),
        }
    }

    /// Counts an error; gives it back when the line is broken.
    fn note_error<E>(&mut self, error: E) -> Option<E> {
        self.line_errors = self.line_errors.wrapping_add(1);
        self.errors_in_a_row += 1;
        if self.errors_in_a_row < MAX_ERRORS_IN_A_ROW {
            return None;
        }
        self.errors_in_a_row = 0;
        Some(error)
    }
}

#[cfg(feature = "embedded-io")]
impl<S: embedded_io::Read, P: Protocol> Reader<S, P> {
    /// Blocks until a packet is complete; `None` at the end of a stream that has one.
    ///
    /// # Errors
    ///
    /// The UART's last error, after [`MAX_ERRORS_IN_A_ROW`] without a byte between them.
    pub fn read_packet(&mut self) -> Result<Option<P::Packet>, S::Error> {
        loop {
            let packet = self.parse_buffered();
            if packet.is_some() {
                return Ok(packet);
            }
            let result = self.serial.read(&mut self.buffer.bytes);
            if let Some(end) = self.note_read(result) {
                return end;
            }
        }
    }
}

#[cfg(feature = "embedded-io-async")]
impl<S: embedded_io_async::Read, P: Protocol> Reader<S, P> {
    /// Waits until a packet is complete; `None` at the end of a stream that has one.
    ///
    /// May be dropped and called again where the UART's own `read` may.
    ///
    /// # Errors
    ///
    /// The UART's last error, after [`MAX_ERRORS_IN_A_ROW`] without a byte between them.
    pub async fn read_packet_async(&mut self) -> Result<Option<P::Packet>, S::Error> {
        loop {
            let packet = self.parse_buffered();
            if packet.is_some() {
                return Ok(packet);
            }
            let result = self.serial.read(&mut self.buffer.bytes).await;
            if let Some(end) = self.note_read(result) {
                return end;
            }
        }
    }
}

#[cfg(feature = "embedded-hal-nb")]
impl<S: embedded_hal_nb::serial::Read, P: Protocol> Reader<S, P> {
    /// Takes the bytes that are there.
    ///
    /// # Errors
    ///
    /// `WouldBlock` when they complete no packet; the UART's last error, after [`MAX_ERRORS_IN_A_ROW`] without a byte
    /// between them.
    pub fn poll_packet(&mut self) -> embedded_hal_nb::nb::Result<P::Packet, S::Error> {
        use embedded_hal_nb::nb;
        loop {
            match self.serial.read() {
                Ok(byte) => {
                    self.errors_in_a_row = 0;
                    if let Some(packet) = self.parser.push(byte) {
                        return Ok(packet);
                    }
                }
                Err(nb::Error::WouldBlock) => return Err(nb::Error::WouldBlock),
                Err(nb::Error::Other(error)) => {
                    if let Some(error) = self.note_error(error) {
                        return Err(nb::Error::Other(error));
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lidar::wire::toy::{self, FRAME};

    #[cfg(feature = "embedded-io")]
    #[test]
    fn a_slice_is_a_stream_with_an_end() {
        let mut bytes = [0u8; 3 * 47 + 1];
        bytes[..47].copy_from_slice(&FRAME);
        bytes[47] = 0x54;
        bytes[48..95].copy_from_slice(&FRAME);
        bytes[95..].copy_from_slice(&FRAME);
        let mut reader = Reader::new(&bytes[..], toy::parser());
        for _ in 0..3 {
            assert!(reader.read_packet().expect("no errors").is_some());
        }
        assert_eq!(reader.read_packet(), Ok(None));
        assert_eq!(reader.parser().counters().skipped_bytes, 1);
    }

    #[cfg(feature = "embedded-io-async")]
    #[test]
    fn the_same_without_blocking_the_executor() {
        use core::{future::Future, pin::pin, task};
        let mut bytes = [0u8; 2 * 47];
        bytes[..47].copy_from_slice(&FRAME);
        bytes[47..].copy_from_slice(&FRAME);
        let mut reader = Reader::new(&bytes[..], toy::parser());
        for expected in [true, true, false] {
            let mut context = task::Context::from_waker(task::Waker::noop());
            let result = pin!(reader.read_packet_async()).poll(&mut context);
            let task::Poll::Ready(Ok(packet)) = result else {
                panic!("{result:?}");
            };
            assert_eq!(packet.is_some(), expected);
        }
    }

    #[cfg(feature = "embedded-hal-nb")]
    #[test]
    fn overruns_are_counted_and_survived() {
        use embedded_hal_nb::{nb, serial};

        struct Uart<I>(I);
        impl<I> serial::ErrorType for Uart<I> {
            type Error = serial::ErrorKind;
        }
        impl<I: Iterator<Item = nb::Result<u8, serial::ErrorKind>>> serial::Read for Uart<I> {
            fn read(&mut self) -> nb::Result<u8, serial::ErrorKind> {
                self.0.next().unwrap_or(Err(nb::Error::WouldBlock))
            }
        }
        const OVERRUN: nb::Result<u8, serial::ErrorKind> =
            Err(nb::Error::Other(serial::ErrorKind::Overrun));

        // The first frame loses its tenth byte to an overrun, the second comes after an idle line.
        let hit = FRAME
            .iter()
            .enumerate()
            .map(|(k, &byte)| if k == 9 { OVERRUN } else { Ok(byte) });
        let idle = [Err(nb::Error::WouldBlock)];
        let line = hit.chain(idle).chain(FRAME.iter().map(|&byte| Ok(byte)));
        let mut reader = Reader::new(Uart(line), toy::parser());
        assert_eq!(reader.poll_packet(), Err(nb::Error::WouldBlock));
        assert!(reader.poll_packet().is_ok());
        assert_eq!(reader.poll_packet(), Err(nb::Error::WouldBlock));
        assert_eq!(reader.line_errors(), 1);
        assert_eq!(reader.parser().counters().skipped_bytes, 46);

        let mut broken = Reader::new(Uart(core::iter::repeat(OVERRUN)), toy::parser());
        assert_eq!(
            broken.poll_packet(),
            Err(nb::Error::Other(serial::ErrorKind::Overrun))
        );
        assert_eq!(broken.line_errors(), u32::from(MAX_ERRORS_IN_A_ROW));
    }
}
