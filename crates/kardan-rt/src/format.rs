//! Constants of `f32` and `f64` for the elementary functions.

/// Constants of a binary format for the elementary functions.
///
/// Polynomials list the constant first, in the variable that the function names.
pub trait Format: Sized + Copy + 'static {
    /// 1/2.
    const HALF: Self;
    /// ∞.
    const INFINITY: Self;
    /// The least number above zero.
    const LEAST: Self;
    /// The largest number.
    const MOST: Self;
    /// The least number of all digits.
    const NORMAL: Self;
    /// A power of two that makes lesser ones normal, and its exponent.
    const LIFT: (Self, Self);
    /// Added and subtracted, it rounds to whole numbers, which are then in the last digits of the sum.
    const ROUND: Self;
    /// `2ᵏ + 1`, k half of the digits.
    const SPLIT: Self;
    /// Up to this the multiples of π/2 below are exact, rad.
    const NEAR: Self;
    /// 2/π.
    const TWO_OVER_PI: Self;
    /// π/2 as three short parts and the rest.
    const HALF_PI: [Self; 4];
    /// 0, π/4, π/2, 3π/4, π in two parts each.
    const EIGHTHS: [(Self, Self); 5];
    /// tan π/8.
    const TAN_PI_8: Self;
    /// The sides of a triangle above or below these values are scaled by those factors.
    const RANGES: ((Self, Self), (Self, Self));
    /// Sides below this are so much shorter than the other that a quotient needs no remainder.
    const NO_REST: Self;
    /// Below and above these, eˣ is 0 and infinite.
    const EXPONENTS: (Self, Self);
    /// 1/ln 2.
    const ONE_OVER_LN_2: Self;
    /// ln 2 as a short part and the rest.
    const LN_2: (Self, Self);
    /// `(sin x − x)/x³` in `x²` up to π/4.
    const SINE: &'static [Self];
    /// The rounding error of the first of them.
    const SINE_REST: Self;
    /// `(cos x − 1 + x²/2)/x⁴` in `x²` up to π/4.
    const COSINE: &'static [Self];
    /// `(eˣ − 1 − x)/x²` in x within ±(ln 2)/2.
    const EXPONENTIAL: &'static [Self];
    /// `(ln((1 + s)/(1 − s))/s − 2)/s²` in `s²` up to `3 − 2√2`.
    const LOGARITHM: &'static [Self];
    /// `(atan x − x)/x³` in `x²` up to tan π/8.
    const ARC_TANGENT: &'static [Self];
    /// `(asin x − x)/x³` in `x²` up to 1/2.
    const ARC_SINE: &'static [Self];

    /// 1 where the whole number in a sum with [`ROUND`](Self::ROUND) is odd, else 0.
    #[must_use]
    fn is_odd(self) -> Self;
    /// −1 where the whole number in a sum with [`ROUND`](Self::ROUND) is 2 or 3 beyond a multiple of 4, else 1.
    #[must_use]
    fn half_turn_sign(self) -> Self;
    /// This times `2ⁿ`, n the whole number in a sum with [`ROUND`](Self::ROUND).
    #[must_use]
    fn scaled(self, rounded: Self) -> Self;
    /// The mantissa of a normal number, from √½ to √2.
    #[must_use]
    fn mantissa(self) -> Self;
    /// The exponent of two beside it.
    #[must_use]
    fn exponent(self) -> Self;
    /// 1 or −1, of zeros too.
    #[must_use]
    fn sign(self) -> Self;
    /// The size of this with the sign of the other.
    #[must_use]
    fn with_sign(self, other: Self) -> Self;
    /// The same number.
    fn widened(self) -> f64;
    /// The nearest number.
    fn nearest(wide: f64) -> Self;
}

macro_rules! bits {
    ($number:ty, one $one:literal, sign $sign:literal, mantissa $mantissa:literal, bias $bias:literal, root_half $root_half:literal) => {
        const HALF: Self = 0.5;
        const INFINITY: Self = <$number>::INFINITY;
        const LEAST: Self = <$number>::from_bits(1);
        const MOST: Self = <$number>::MAX;
        const NORMAL: Self = <$number>::MIN_POSITIVE;

        #[inline]
        fn is_odd(self) -> Self {
            // The digits of 1, or none.
            Self::from_bits((self.to_bits() & 1).wrapping_neg() & $one.to_bits())
        }

        #[inline]
        fn half_turn_sign(self) -> Self {
            // The second last digit as sign.
            Self::from_bits(((self.to_bits() & 2) << $sign) | $one.to_bits())
        }

        #[inline]
        fn scaled(self, rounded: Self) -> Self {
            let power = rounded.to_bits().wrapping_sub(Self::ROUND.to_bits()).cast_signed();
            let half = power >> 1;
            let two_to = |power: _| {
                let power = $bias.wrapping_add(power).cast_unsigned();
                Self::from_bits(power << $mantissa)
            };
            self * two_to(half) * two_to(power.wrapping_sub(half))
        }

        #[inline]
        fn mantissa(self) -> Self {
            let bits = self.to_bits();
            let exponent = (bits.wrapping_sub($root_half).cast_signed() >> $mantissa).cast_unsigned();
            Self::from_bits(bits.wrapping_sub(exponent << $mantissa))
        }

        #[inline]
        fn exponent(self) -> Self {
            let exponent = (self.to_bits().wrapping_sub($root_half).cast_signed() >> $mantissa).cast_unsigned();
            Self::from_bits(Self::ROUND.to_bits().wrapping_add(exponent)) - Self::ROUND
        }

        #[inline]
        fn sign(self) -> Self {
            $one.copysign(self)
        }

        #[inline]
        fn with_sign(self, other: Self) -> Self {
            self.copysign(other)
        }

        #[inline]
        #[allow(clippy::useless_conversion)] // of `f64`
        fn widened(self) -> f64 {
            f64::from(self)
        }

        #[inline]
        #[allow(clippy::as_conversions, clippy::cast_possible_truncation, clippy::unnecessary_cast)] // to the nearest
        fn nearest(wide: f64) -> Self {
            wide as Self
        }
    };
}

impl Format for f64 {
    const LIFT: (Self, Self) = (18_014_398_509_481_984.0, 54.0);
    const ROUND: Self = 6_755_399_441_055_744.0;
    const SPLIT: Self = 134_217_729.0;
    const NEAR: Self = 1_647_000.0;
    const TWO_OVER_PI: Self = core::f64::consts::FRAC_2_PI;
    const HALF_PI: [Self; 4] =
        [1.570_796_326_734_125_6, 6.077_100_506_303_966e-11, 2.022_266_248_711_166_5e-21, 8.478_427_660_368_9e-32];
    const EIGHTHS: [(Self, Self); 5] = [
        (0.0, 0.0),
        (core::f64::consts::FRAC_PI_4, 3.061_616_997_868_383e-17),
        (core::f64::consts::FRAC_PI_2, 6.123_233_995_736_766e-17),
        (2.356_194_490_192_345, 9.184_850_993_605_148e-17),
        (core::f64::consts::PI, 1.224_646_799_147_353_2e-16),
    ];
    const TAN_PI_8: Self = 0.414_213_562_373_095_03;
    // 2^900, 2^-100; 2^-400, 2^400
    const RANGES: ((Self, Self), (Self, Self)) = (
        (8.452_712_498_170_644e270, 7.888_609_052_210_118e-31),
        (3.872_591_914_849_318e-121, 2.582_249_878_086_908_6e120),
    );
    // 2^-900
    const NO_REST: Self = 1.183_052_186_166_774_7e-271;
    const EXPONENTS: (Self, Self) = (-746.0, 710.0);
    const ONE_OVER_LN_2: Self = core::f64::consts::LOG2_E;
    const LN_2: (Self, Self) = (0.693_147_180_559_663, 2.823_529_056_303_157_7e-13);
    const SINE: &'static [Self] = &[
        -0.166_666_666_666_666_66,
        0.008_333_333_333_333_331,
        -0.000_198_412_698_412_650_2,
        2.755_731_921_930_279_6e-06,
        -2.505_210_621_982_557_6e-08,
        1.605_852_962_030_773_5e-10,
        -7.586_579_414_439_557e-13,
    ];
    const SINE_REST: Self = -9.240_109_900_177_261e-18;
    const COSINE: &'static [Self] = &[
        0.041_666_666_666_666_664,
        -0.001_388_888_888_888_738_2,
        2.480_158_729_874_360_2e-05,
        -2.755_731_726_028_422e-07,
        2.087_614_388_527_359_5e-09,
        -1.138_246_089_677_735_4e-11,
    ];
    const EXPONENTIAL: &'static [Self] = &[
        0.5,
        0.166_666_666_666_666_7,
        0.041_666_666_666_666_67,
        0.008_333_333_333_326_084,
        0.001_388_888_888_888_371_1,
        0.000_198_412_698_750_022_8,
        2.480_158_732_567_746e-05,
        2.755_725_517_000_089e-06,
        2.755_727_347_871_858e-07,
        2.510_531_272_962_210_3e-08,
        2.091_475_532_589_32e-09,
    ];
    const LOGARITHM: &'static [Self] = &[
        0.666_666_666_666_666_6,
        0.400_000_000_000_009_4,
        0.285_714_285_707_644_5,
        0.222_222_224_005_477_6,
        0.181_817_947_008_978,
        0.153_862_905_346_589_92,
        0.132_674_185_964_748_84,
        0.131_007_213_835_034_9,
    ];
    const ARC_TANGENT: &'static [Self] = &[
        -0.333_333_333_333_333_3,
        0.199_999_999_999_997_85,
        -0.142_857_142_856_546_38,
        0.111_111_111_046_522_55,
        -0.090_909_087_285_874_59,
        0.076_922_956_583_278_73,
        -0.066_664_120_777_252_74,
        0.058_787_824_694_439_814,
        -0.052_293_804_737_818_4,
        0.045_467_195_095_551_666,
        -0.034_445_844_423_577_385,
        0.016_148_228_546_771_868,
    ];
    const ARC_SINE: &'static [Self] = &[
        0.166_666_666_666_666_66,
        0.075_000_000_000_001_18,
        0.044_642_857_142_551_895,
        0.030_381_944_475_532_34,
        0.022_372_157_443_507_22,
        0.017_352_816_540_325_496,
        0.013_963_780_012_203_57,
        0.011_566_459_612_121_669,
        0.009_621_842_970_100_282,
        0.009_319_560_794_767_446,
        0.003_044_879_909_455_677_3,
        0.019_554_513_336_123_378,
        -0.019_241_671_746_743_04,
        0.029_612_011_264_955_12,
    ];

    bits!(f64, one 1.0_f64, sign 62, mantissa 52, bias 1023_i64, root_half 0x3fe6_a09e_667f_3bcd_u64);
}

impl Format for f32 {
    const LIFT: (Self, Self) = (33_554_432.0, 25.0);
    const ROUND: Self = 12_582_912.0;
    const SPLIT: Self = 4097.0;
    const NEAR: Self = 6433.0;
    const TWO_OVER_PI: Self = core::f32::consts::FRAC_2_PI;
    const HALF_PI: [Self; 4] = [1.570_312_5, 0.000_483_751_3, 7.549_533_6e-08, 2.563_344e-12];
    const EIGHTHS: [(Self, Self); 5] = [
        (0.0, 0.0),
        (core::f32::consts::FRAC_PI_4, -2.185_569_4e-08),
        (core::f32::consts::FRAC_PI_2, -4.371_139e-08),
        (2.356_194_5, -5.962_440_3e-09),
        (core::f32::consts::PI, -8.742_278e-08),
    ];
    const TAN_PI_8: Self = 0.414_213_57;
    // 2^100, 2^-30; 2^-40, 2^80
    const RANGES: ((Self, Self), (Self, Self)) = ((1.267_650_6e30, 9.313_226e-10), (9.094_947e-13, 1.208_925_8e24));
    // 2^-90
    const NO_REST: Self = 8.077_936e-28;
    const EXPONENTS: (Self, Self) = (-104.0, 89.0);
    const ONE_OVER_LN_2: Self = core::f32::consts::LOG2_E;
    const LN_2: (Self, Self) = (0.693_145_75, 1.428_606_8e-06);
    const SINE: &'static [Self] = &[-0.166_666_67, 0.008_333_332, -0.000_198_400_83, 2.724_932_8e-06];
    const SINE_REST: Self = 4.995_387_5e-9;
    const COSINE: &'static [Self] = &[0.041_666_664, -0.001_388_830_1, 2.454_745e-05];
    const EXPONENTIAL: &'static [Self] =
        &[0.5, 0.166_666_67, 0.041_666_463, 0.008_333_310_5, 0.001_393_373_1, 0.000_198_910_8];
    const LOGARITHM: &'static [Self] = &[0.666_666_7, 0.400_001_26, 0.285_503_98, 0.233_419_43];
    const ARC_TANGENT: &'static [Self] =
        &[-0.333_333_34, 0.199_999_76, -0.142_840_94, 0.110_703_12, -0.086_168_64, 0.050_280_806];
    const ARC_SINE: &'static [Self] =
        &[0.166_666_66, 0.075_000_94, 0.044_599_403, 0.031_100_662, 0.017_149_238, 0.033_690_847];

    bits!(f32, one 1.0_f32, sign 30, mantissa 23, bias 127_i32, root_half 0x3f35_04f3_u32);
}
