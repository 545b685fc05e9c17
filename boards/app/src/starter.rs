//! Asks a lidar to start, and asks again where nothing came of it or its packets stop.

use beamfix::lidar::{
    Model, Request, Start,
    startup::{Action, StartConfig, StartError, Startup},
};

use crate::{
    supervisor::{Care, PAUSE_US},
    telemetry::LidarState,
};

/// What the board is to do for the lidar.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Wanted {
    /// Send it these bytes.
    Send(Request),
    /// Set its line to so many bits a second, once all that was to be sent has left it.
    SetBaud(u32),
}

/// See the module. A lidar that starts by itself is left alone.
pub struct Starter {
    model: &'static Model,
    startup: Startup,
    /// When it failed, and why.
    failed: Option<(u32, StartError)>,
    /// Whether the first attempt still runs.
    is_first: bool,
    is_ready: bool,
    /// Whether packets came since then.
    has_packets: bool,
}

impl Starter {
    /// Nothing asked yet.
    #[must_use]
    #[inline(always)]
    pub const fn new(model: &'static Model) -> Self {
        Self {
            model,
            startup: Startup::new(model, StartConfig::DEFAULT),
            failed: None,
            is_first: true,
            is_ready: false,
            has_packets: false,
        }
    }

    /// Takes what the lidar sent: its answers, while it is started.
    pub fn heard(&mut self, bytes: &[u8]) {
        if !self.is_ready {
            bytes.iter().for_each(|&byte| self.startup.push(byte));
        }
    }

    /// What the lidar needs now; to be asked until it is nothing, after every look of the supervisor.
    pub fn wants(&mut self, now_us: u32) -> Option<Wanted> {
        if self.model.start == Start::Listen {
            return None;
        }
        if let Some((failed_us, _)) = self.failed {
            if now_us.wrapping_sub(failed_us) < PAUSE_US {
                return None;
            }
            self.failed = None;
            self.startup = Startup::new(self.model, StartConfig::DEFAULT);
        }
        loop {
            match self.startup.poll(now_us) {
                Action::Send(request) => return Some(Wanted::Send(request)),
                Action::SetBaud(baud) => return Some(Wanted::SetBaud(baud)),
                // The supervisor has its motor turn from the start.
                Action::MotorOn => {}
                Action::Wait => return None,
                Action::Ready(_) => {
                    (self.is_first, self.is_ready) = (false, true);
                    return None;
                }
                Action::Failed(error) => {
                    (self.is_first, self.is_ready, self.has_packets) = (false, false, false);
                    self.failed = Some((now_us, error));
                    return None;
                }
            }
        }
    }

    /// The angle that looks forward by the lidar's own calibration (0.01°), once it has started and where it told one.
    #[must_use]
    pub fn zero_cdeg(&self) -> Option<u16> {
        self.startup.zero_cdeg().filter(|_| self.is_ready)
    }

    /// Takes what the supervisor saw, and says what it means of a lidar from which no revolutions come.
    pub fn look(&mut self, now_us: u32, care: &mut Care) {
        if self.model.start == Start::Listen {
            return;
        }
        if care.packets {
            self.startup.packet_arrived(now_us);
            self.has_packets |= self.is_ready;
        }
        if care.turns {
            return;
        }
        match self.failed {
            Some((_, StartError::Unhealthy(_))) => care.lidar = LidarState::Defective,
            _ if self.is_first => care.lidar = LidarState::Starting,
            _ if !self.has_packets && care.lidar != LidarState::Silent => {
                care.lidar = LidarState::Starting;
            }
            _ => {}
        }
    }
}
