//! H.264 by openh264.

use openh264::OpenH264API;
use openh264::decoder::{DecodedYUV, Decoder};
use openh264::encoder::{
    BitRate, Complexity, Encoder, EncoderConfig, FrameRate, FrameType, IntraFramePeriod,
    RateControlMode, SpsPpsStrategy, UsageType, VuiConfig,
};
use openh264::formats::{YUVSlices, YUVSource};
use openh264_sys2::{ENCODER_OPTION_SVC_ENCODE_PARAM_EXT, SEncParamExt};

use crate::VideoError;
use crate::picture::{Picture, PictureDecoder, PictureEncoder};

/// A quantisation parameter: each 6 more double the step. Lumels take 6 to 36.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Qp(u8);

impl Qp {
    /// The finest and the coarsest.
    pub const RANGE: std::ops::RangeInclusive<u8> = 6..=36;

    /// The parameter, if it is within the range.
    pub fn new(qp: u8) -> Option<Self> {
        Self::RANGE.contains(&qp).then_some(Self(qp))
    }

    /// What suits lumels on pages of so many a side, so that they lose at most 1.5 dB: 9, but 12 for
    /// pages of more than 256 and 18 for pages of more than 512, which lose less and cost more bytes.
    pub fn for_pages(side: u32) -> Self {
        Self(match side {
            0..=256 => 9,
            257..=512 => 12,
            _ => 18,
        })
    }

    /// As a number.
    pub fn get(self) -> u8 {
        self.0
    }
}

impl std::fmt::Display for Qp {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.fmt(f)
    }
}

/// Encodes H.264 in Annex B, a keyframe with its parameter sets in front.
///
/// openh264 is made for calls between people, so its own rules are off: it neither skips frames, nor
/// keeps a bit rate, nor looks for cuts, backgrounds or parts that the eye might forgive.
pub struct H264Encoder {
    encoder: Encoder,
    size: (u32, u32),
}

/// Beyond what any picture needs: rate control has nothing to hold back.
const AMPLE: BitRate = BitRate::from_bps(200_000_000);
/// What the encoder states, and nobody reads: pictures come when there is light.
const RATE: FrameRate = FrameRate::from_hz(30.0);
/// Longest and shortest side.
const LIMITS: (u32, u32) = (3840, 2160);

impl H264Encoder {
    /// Whether pictures are of a size that can be encoded.
    ///
    /// # Errors
    /// [`VideoError::Size`] beyond 3840 × 2160, either way round.
    pub fn check(width: u32, height: u32) -> Result<(), VideoError> {
        let is_too_large = width.max(height) > LIMITS.0 || width.min(height) > LIMITS.1;
        if is_too_large { Err(VideoError::Size { width, height }) } else { Ok(()) }
    }

    /// For pictures of a size. The first one is a keyframe, asked for or not.
    ///
    /// # Errors
    /// As [`Self::check`]; [`VideoError::Encoder`].
    pub fn new(width: u32, height: u32, qp: Qp) -> Result<Self, VideoError> {
        Self::check(width, height)?;
        let config = EncoderConfig::new()
            .rate_control_mode(RateControlMode::Off)
            .bitrate(AMPLE)
            .max_frame_rate(RATE)
            .skip_frames(false)
            .scene_change_detect(false)
            .adaptive_quantization(false)
            .background_detection(false)
            .long_term_reference(false)
            .usage_type(UsageType::CameraVideoRealTime)
            .complexity(Complexity::Medium)
            .intra_frame_period(IntraFramePeriod::auto())
            .sps_pps_strategy(SpsPpsStrategy::ConstantId)
            .num_threads(1)
            .vui(VuiConfig::bt709_full());
        let mut encoder =
            Encoder::with_api_config(OpenH264API::from_source(), config).map_err(failed)?;
        // The library has settings to change once it has coded a picture.
        encoder.encode(&planes(&Picture::plain(width, height, 128, [128; 2]))).map_err(failed)?;
        let mut settings = settings(&mut encoder)?;
        settings.sSpatialLayers[0].iDLayerQp = qp.0.into();
        change(&mut encoder, settings)?;
        encoder.force_intra_frame();
        Ok(Self { encoder, size: (width, height) })
    }
}

/// The settings that the library goes by.
fn settings(encoder: &mut Encoder) -> Result<SEncParamExt, VideoError> {
    let mut settings = SEncParamExt::default();
    #[expect(unsafe_code, reason = "the wrapper does not tell settings")]
    // SAFETY: the option takes a pointer to these settings, and writes them before it returns.
    let result = unsafe {
        let settings = (&raw mut settings).cast();
        encoder.raw_api().get_option(ENCODER_OPTION_SVC_ENCODE_PARAM_EXT, settings)
    };
    if result == 0 { Ok(settings) } else { Err(unset()) }
}

fn change(encoder: &mut Encoder, mut settings: SEncParamExt) -> Result<(), VideoError> {
    #[expect(unsafe_code, reason = "the wrapper has no quantiser without rate control")]
    // SAFETY: the option takes a pointer to these settings, and reads them before it returns.
    let result = unsafe {
        let settings = (&raw mut settings).cast();
        encoder.raw_api().set_option(ENCODER_OPTION_SVC_ENCODE_PARAM_EXT, settings)
    };
    if result == 0 { Ok(()) } else { Err(unset()) }
}

fn unset() -> VideoError {
    VideoError::Encoder("it does not take the quantiser".into())
}

impl PictureEncoder for H264Encoder {
    fn encode(&mut self, picture: &Picture, keyframe: bool) -> Result<Vec<u8>, VideoError> {
        let Picture { width, height, .. } = *picture;
        if (width, height) != self.size {
            return Err(VideoError::Size { width, height });
        }
        if keyframe {
            self.encoder.force_intra_frame();
        }
        let coded = self.encoder.encode(&planes(picture)).map_err(failed)?;
        match coded.frame_type() {
            FrameType::Skip | FrameType::Invalid => {
                Err(VideoError::Encoder("it has left a picture out".into()))
            }
            _ => Ok(coded.to_vec()),
        }
    }
}

fn planes(picture: &Picture) -> YUVSlices<'_> {
    let (width, height) = (picture.width as usize, picture.height as usize);
    let [u, v] = &picture.chroma;
    let strides = (width, width / 2, width / 2);
    YUVSlices::new((&picture.luma, u, v), (width, height), strides)
}

fn failed(error: openh264::Error) -> VideoError {
    VideoError::Encoder(error.to_string())
}

/// Decodes what [`H264Encoder`] makes.
pub struct H264Decoder(Decoder);

impl H264Decoder {
    /// Waits for a keyframe.
    ///
    /// # Errors
    /// [`VideoError::Unit`] when the library cannot make a decoder.
    pub fn new() -> Result<Self, VideoError> {
        Decoder::new().map(Self).map_err(undecodable)
    }
}

impl PictureDecoder for H264Decoder {
    fn decode(&mut self, unit: &[u8]) -> Result<Picture, VideoError> {
        let decoded = self.0.decode(unit).map_err(undecodable)?;
        decoded.as_ref().map(picture).ok_or_else(|| VideoError::Unit("it holds no picture".into()))
    }
}

fn undecodable(error: openh264::Error) -> VideoError {
    VideoError::Unit(error.to_string())
}

/// The planes without the padding between their rows.
fn picture(decoded: &DecodedYUV<'_>) -> Picture {
    let (width, height) = decoded.dimensions();
    let (y, u, v) = decoded.strides();
    let plane = |samples: &[u8], stride: usize, width: usize, height: usize| -> Vec<u8> {
        samples.chunks(stride).take(height).flat_map(|row| &row[..width]).copied().collect()
    };
    Picture {
        width: width as u32,
        height: height as u32,
        luma: plane(decoded.y(), y, width, height),
        chroma: [
            plane(decoded.u(), u, width / 2, height / 2),
            plane(decoded.v(), v, width / 2, height / 2),
        ],
    }
}

#[cfg(test)]
mod tests {
    use openh264_sys2::{CAMERA_VIDEO_REAL_TIME, CONSTANT_ID, MEDIUM_COMPLEXITY, RC_OFF_MODE};

    use super::*;

    /// The library may have its own mind: it is asked for the settings that it goes by.
    #[test]
    fn the_library_goes_by_the_settings_that_are_chosen() {
        let mut encoder = H264Encoder::new(64, 32, Qp(9)).expect("an encoder");
        encoder.encode(&Picture::plain(64, 32, 90, [128; 2]), true).expect("a unit");
        let has = settings(&mut encoder.encoder).expect("settings");
        assert!(!has.bEnableFrameSkip && !has.bEnableSceneChangeDetect);
        assert!(!has.bEnableAdaptiveQuant && !has.bEnableBackgroundDetection);
        assert!(!has.bEnableLongTermReference && !has.bEnableDenoise);
        assert_eq!(has.iRCMode, RC_OFF_MODE);
        assert_eq!((has.iTargetBitrate, has.fMaxFrameRate), (200_000_000, 30.0));
        assert_eq!(
            (has.iUsageType, has.iComplexityMode),
            (CAMERA_VIDEO_REAL_TIME, MEDIUM_COMPLEXITY)
        );
        assert_eq!((has.uiIntraPeriod, has.eSpsPpsIdStrategy), (0, CONSTANT_ID));
        assert_eq!(has.iMultipleThreadIdc, 1);
        let [layer, ..] = has.sSpatialLayers;
        assert_eq!(layer.iDLayerQp, 9);
        assert!(layer.bVideoSignalTypePresent && layer.bFullRange, "full range");
    }
}
