//! RPLIDAR requests and what answers them.
