//! The motor's PWM line, on a machine that has none: its duty leaves by a UART, a byte (%) whenever it changes.

use core::convert::Infallible;

use embedded_hal::pwm::{ErrorType, SetDutyCycle};

use crate::uart::Uart;

/// See the module.
pub struct Line {
    /// Told last; `None` at the start, so that the first is told.
    percent: Option<u16>,
}

impl Line {
    /// Nothing told so far.
    pub const LOW: Self = Self { percent: None };
}

impl ErrorType for Line {
    type Error = Infallible;
}

impl SetDutyCycle for Line {
    fn max_duty_cycle(&self) -> u16 {
        100
    }

    fn set_duty_cycle(&mut self, percent: u16) -> Result<(), Infallible> {
        // Where nobody reads it, the line is full one day.
        if self.percent != Some(percent) && Uart::MOTOR.try_send(percent as u8) {
            self.percent = Some(percent);
        }
        Ok(())
    }
}
