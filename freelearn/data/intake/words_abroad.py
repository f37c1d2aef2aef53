"""Words for the usual quantities in languages other than English, as headings have them, and how they are compared."""

from __future__ import annotations

import unicodedata

# As `plain` leaves them, without accents. German, French, Italian, Spanish, Japanese:
ABROAD: dict[str, str] = {
    "inner_diameter": r"innendurchmesser|diametre (interieur|interne)|diametro (interno|interior)|内径",
    "wall": r"wand(starke|staerke|dicke)|epaisseur( de (la )?paroi)?|spessore( (della )?parete)?"
    r"|espesor( de (la )?pared)?|肉厚",
    "outer_diameter_mm": r"aussendurchmesser|durchmesser|diametre( (exterieur|externe))?"
    r"|diametro( (esterno|exterior|externo))?"
    r"|外径|直径",
    "inner_radius_mm": r"innenradius|rayon (interieur|interne)|raggio interno|radio (interior|interno)|内半径",
    "outer_radius_mm": r"aussenradius|rayon (exterieur|externe)|raggio esterno|radio (exterior|externo)|外半径",
    "gamma_deg": r"faserwinkel|flechtwinkel|wickelwinkel|angle (des fibres|de fibre|de tressage|d'enroulement)"
    r"|angolo (delle fibre|di fibra|di avvolgimento)|angulo (de (la )?fibra|de (las )?fibras|de trenzado)"
    r"|繊維角度?|編み角度?",
    "elongation_mm": r"(standard|traversen)?weg|auszug|langenanderung|laengenaenderung|verlangerung"
    r"|verlaengerung|dehnung|hub|verschiebung"
    r"|allongement|deplacement|course|allungamento|spostamento|corsa|alargamiento|elongacion|desplazamiento|carrera"
    r"|伸び|変位|ストローク",
    "length_mm": r"(ruhe|frei|ausgangs|anfangs|mess|nenn)?(lange|laenge)( unbelastet| im ruhezustand)?"
    r"|longueur( (initiale|libre|a vide|au repos|nominale))?|lunghezza( (iniziale|libera|a riposo|nominale))?"
    r"|longitud( (inicial|libre|en reposo|nominal))?|長さ|全長|自然長|初期長さ?",
    "strain": r"dehnung|stauchung|kontraktion|verkurzung|verkuerzung|allongement|deformation|contraction"
    r"|raccourcissement|deformazione|contrazione|deformacion|contraccion|ひずみ|歪み?|収縮率?",
    "stretch": r"streckung|verstreckung|elongation relative|伸長比",
    "twist_deg": r"verdrehung|drehwinkel|verdrehwinkel|torsionswinkel|winkel|drehung|rotation|torsion"
    r"|angle de (torsion|rotation)|rotazione|torsione|angolo( di (torsione|rotazione))?"
    r"|rotacion|giro|angulo( de (torsion|giro|rotacion))?|角度|ねじれ角?|ねじり角?|回転角?",
    "pressure_kpa": r"(innen|uber|ueber|luft)?druck|pression|pressione|presion|圧力|内圧",
    "moment_nmm": r"drehmoment|torsionsmoment|couple|moment de torsion|coppia|momento( torcente)?|par( de torsion)?"
    r"|momento torsor|トルク|モーメント",
    "stress": r"((nenn|zug|ingenieur|wahre?) ?)?spannung|contrainte( (nominale|vraie))?|sforzo|tensione( nominale)?"
    r"|esfuerzo( nominal)?|(公称|真)?応力",
    "force_n": r"(axial|zug|druck|standard)?kraft|last|effort|force axiale|charge|forza( assiale)?|carico"
    r"|fuerza( axial)?|carga"
    r"|力|荷重|張力|軸力",
    "time_s": r"(mess|pruf|pruef|kraft|druck|weg)?zeit|zeitstempel|zeitpunkt|temps|horodatage|tempo|tiempo|時間|時刻",
    "temperature_c": r"temperatur|temperatura|温度",
    "run": r"versuch|messung|lauf|aufnahme|essai|enregistrement|prova|registrazione|ensayo|prueba|試行|実験",
    "sample": r"probe|prufling|pruefling|muskel|aktor|aktuator|schlauch|echantillon|eprouvette|actionneur|campione"
    r"|provino|attuatore|muscolo|muestra|probeta|actuador|musculo|試料|試験片|アクチュエータ|サンプル",
}

# Dutch, Czech and Polish:
FURTHER_ABROAD: dict[str, str] = {
    "inner_diameter": r"binnendiameter|inwendige diameter|vnitrni prumer|srednica wewnetrzna",
    "wall": r"wanddikte|tloustka( steny)?|grubosc( scianki)?",
    "outer_diameter_mm": r"buitendiameter|uitwendige diameter|(vnejsi )?prumer|srednica( zewnetrzna)?",
    "inner_radius_mm": r"binnenstraal|vnitrni polomer|promien wewnetrzny",
    "outer_radius_mm": r"buitenstraal|vnejsi polomer|promien zewnetrzny",
    "gamma_deg": r"(vezel|vlecht)hoek|uhel (vlaken|opleteni)|kat (wlokien|splotu|oplotu)",
    "elongation_mm": r"verlenging|uitrekking|verplaatsing|slag|prodlouzeni|posunuti|posuv|draha|zdvih"
    r"|wydluzenie|przemieszczenie|droga|skok",
    "length_mm": r"(rust|begin|vrije )?lengte( onbelast)?|((pocatecni|klidova|volna) )?delka"
    r"|dlugosc( (poczatkowa|spoczynkowa|swobodna))?",
    "strain": r"rek|vervorming|verkorting|contractie|pretvoreni|deformace|pomerne prodlouzeni|zkraceni|kontrakce"
    r"|odksztalcenie|wydluzenie wzgledne|skrocenie|skurcz|kontrakcja",
    "stretch": r"rekverhouding",
    "twist_deg": r"verdraaiing|(torsie|draai)?hoek|rotatie|torsie|zkrut|natoceni|pootoceni|uhel( (zkrutu|natoceni))?"
    r"|skrecenie|obrot|kat( (skrecenia|obrotu))?",
    "pressure_kpa": r"((over|lucht|binnen)?druk)|((vnitrni )?(tlak|pretlak))|cisnienie( wewnetrzne)?|nadcisnienie",
    "moment_nmm": r"(draai|torsie)?koppel|(draai|torsie)moment|(kroutici|tocivy) moment|moment (obrotowy|skrecajacy)",
    "stress": r"spanning|napeti|naprezenie",
    "force_n": r"(axiale )?(trek|druk)?kracht|belasting|(osova )?sila|zatizeni|sila (osiowa|osova)|obciazenie",
    "time_s": r"tijd(stempel)?|tijdstip|cas|czas",
    "temperature_c": r"temperatuur|teplota",
    "run": r"proef|meting|opname|mereni|pokus|zkouska|pomiar|nagranie",
    "sample": r"monster|proefstuk|spier|vzorek|sval|probka|miesien|silownik",
}
WORDS_OF_LANGUAGES = (ABROAD, FURTHER_ABROAD)

# Parts of words that say that a length becomes shorter, as `plain` leaves them.
CONTRACTIONS = (
    "contract",
    "shorten",
    "kontrakt",
    "verkurz",
    "verkuerz",
    "stauch",
    "contraz",
    "contrac",
    "raccourc",
    "収縮",
    "verkort",
    "zkracen",
    "kontrakc",
    "skrocen",
    "skurcz",
)

# Latin letters, digits and brackets as Japanese keyboards write them; not NFKC, for which ² is 2.
FULL_WIDTH = {0xFF01 + i: 0x21 + i for i in range(94)} | {0x3000: 0x20}
# A letter that is no letter with an accent.
STROKES = {ord("ł"): "l"}


def plain(text: str) -> str:
    """Lower case, full-width signs as plain ones, Latin letters without accents.

    >>> plain("Länge（ｍｍ）"), plain("Außendurchmesser"), plain("圧力")
    ('lange(mm)', 'aussendurchmesser', '圧力')
    """
    folded = text.translate(FULL_WIDTH).casefold().translate(STROKES)
    return "".join(unicodedata.normalize("NFD", c)[0] if c.isalpha() and c < "\u0250" else c for c in folded)
